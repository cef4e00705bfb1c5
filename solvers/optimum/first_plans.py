"""First plans of the exact search over all agents, by best responses.

Among walls, where the search may be long without any plan, selfish responses come first, and the
cheapest plans on the way to an equilibrium count, so that a result costs more than an equilibrium
only where a short limit ends these responses.  Responses under the rule that is minimised follow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ppg_env.game.game import Game
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.dispatch import ENGINE
from solvers.engine.refine import refine
from solvers.equilibrium.best_response_dynamics import run_dynamics
from solvers.equilibrium.dynamics_run import FIRST_EFFORT, UNPROVED_EFFORT, Purpose
from solvers.liability import Liability, make_rule
from solvers.pricing import PricedProfile, price_profile
from solvers.solution import Solution

MOST_DIRECT = 3
"""Up to this number of agents, the exact search finds its first plans quickly without walls."""

FIRST_SWEEPS = 2
"""Sweeps of best responses that make the first plans of the exact search."""

EQUILIBRIUM_SWEEPS, MOST_SWEEPS = 6, 50
"""Sweeps of selfish best responses for plans of an equilibrium, without its proof; the same among
walls if a time limit ends them."""

EQUILIBRIUM_SHARE, WALLED_SHARE = 0.5, 0.85
"""Part of the time limit that they may take, and the same among walls."""


def first_plans(
    rule: Liability,
    walled: bool,
    budget: Budget,
    on_value: Callable[[float], None],
    known: PricedProfile | None = None,
) -> Profile | None:
    """Return plans of all agents where the exact search may take long to find some.

    Without walls the search asks for them once it has become long.  Plans that are ``known`` take
    the place of selfish responses.
    """
    start = None if known is None else known.profile
    if len(rule.game.agents) <= MOST_DIRECT and not walled:
        return start
    best, purpose = _Cheapest(rule.potential, on_value), Purpose(jointly=False)
    best.accept(start)
    if walled:
        settled = start is not None
        if start is None:
            selfish = equilibrium_plans(rule.game, budget, WALLED_SHARE, MOST_SWEEPS, best.accept)
            best.accept(selfish.profile)
            settled = _settled(selfish)
        best.refine(budget)
        if best.profile is None or budget.out or rule.charge == "selfish":
            return best.profile
        if budget.limit is not None:
            effort = UNPROVED_EFFORT if settled else FIRST_EFFORT
            purpose = replace(purpose, effort=effort, refine_after=1)
    dynamics = run_dynamics(
        rule,
        ENGINE,
        Budget(budget.left),
        start=best.profile,
        max_sweeps=FIRST_SWEEPS,
        purpose=replace(purpose, accept=best.accept),
    )
    best.accept(dynamics.profile)
    if walled:
        best.refine(budget)
    return best.profile


def equilibrium_plans(
    game: Game,
    budget: Budget,
    share: float = EQUILIBRIUM_SHARE,
    most_sweeps: int = EQUILIBRIUM_SWEEPS,
    accept: Callable[[Profile], None] | None = None,
) -> Solution:
    """Return selfish best responses without the proof of an equilibrium.

    They are those of the dynamics with the same time limit, of which they take a ``share``.
    """
    return run_dynamics(
        make_rule(game, "selfish"),
        ENGINE,
        Budget(budget.left),
        max_sweeps=EQUILIBRIUM_SWEEPS if budget.limit is None else most_sweeps,
        purpose=Purpose(False, False, share, accept),
    )


def _settled(dynamics: Solution) -> bool:
    """Return whether the last responses of all agents changed nothing: more effort is due."""
    last = {update.agent: update for update in dynamics.trace}
    settled = all(update.before == update.after for update in last.values())
    return settled and len(last) == len(dynamics.game.agents)


class _Cheapest:
    """The cheapest of the profiles that it accepts."""

    def __init__(self, objective: Objective | None, on_value: Callable[[float], None]) -> None:
        assert objective is not None
        self._objective, self._value, self._on_value = objective, float("inf"), on_value
        self.profile: Profile | None = None

    def refine(self, budget: Budget) -> None:
        """Improve the plans with their arrivals and faces as they are, if a time limit is near."""
        if self.profile is not None and budget.limit is not None and not budget.out:
            self.accept(refine(self._objective, self.profile, budget))

    def accept(self, profile: Profile | None) -> None:
        """Keep a profile if it costs less than those before."""
        priced = None if profile is None else price_profile(self._objective, profile)
        if priced is not None and priced.value < self._value:
            self.profile, self._value = priced.profile, priced.value
            self._on_value(priced.value)
