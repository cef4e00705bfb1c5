"""What is proved about the best and the worst equilibrium of a game."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from ppg_env.game.game import Game
from solvers.equilibrium.enumeration import Equilibrium


class Between(NamedTuple):
    """A proved interval."""

    low: float
    high: float

    @property
    def gap(self) -> float:
        """Width relative to the upper limit; infinite if a limit is."""
        width = self.high - self.low
        return width / max(abs(self.high), 1e-9) if width < inf else inf

    def over(self, other: Between) -> Between:
        """Return the interval of a quotient of positive numbers."""
        low = self.low / other.high if self.low > 0 else 0.0
        return Between(low, self.high / other.low if other.low > 0 else inf)


@dataclass(frozen=True)
class EquilibriumBounds:
    """Intervals for the best and the worst epsilon-equilibrium in plans.

    Attributes
    ----------
    game, epsilon : the game, and the gain that an equilibrium leaves to each agent at most.
    optimum : the least social cost of all profiles.
    best, worst : the least and the largest social cost of all epsilon-equilibria.
    risk : bounds on ``risk_bound_any`` in all epsilon-equilibria: no equilibrium is below ``low``
        or above ``high``.
    sampled : the equilibria that were found, cheapest first.
    refined : whether the game allows more than the coarse bounds: two agents without obstacles
        and effort that keep apart at instants and leave at their goals.
    arrivals, open : numbers of vectors of arrivals: all, and those whose proofs are not complete.
    inequalities : equilibrium inequalities of all proofs.
    seconds : wall time.
    """

    game: Game
    epsilon: float
    optimum: Between
    best: Between
    worst: Between
    risk: Between
    sampled: tuple[Equilibrium, ...]
    refined: bool
    arrivals: int
    open: int
    inequalities: int
    seconds: float

    @property
    def price_of_stability(self) -> Between:
        """The best equilibrium's social cost over the optimum."""
        return self.best.over(self.optimum)

    @property
    def price_of_anarchy(self) -> Between:
        """The worst equilibrium's social cost over the optimum."""
        return self.worst.over(self.optimum)
