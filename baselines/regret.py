r"""Regret of players in the environment, between a gain that was found and a bound that is proved.

    E[cost of i] - E[cost of i when it deviates]  <=  regret_i  <=  E[cost of i] - solo bound

Left is the gain of any deviation (:mod:`baselines.deviations`) with the others' players unchanged:
a better one may exist.  Right, no policy of agent i costs less than alone in the game
(:func:`solvers.feedback.bounds.lower_bound.solo_lower_bound`).  The best deviation is chosen on one
group of episodes and evaluated on another, so that its interval is unbiased; both sides have the
same noise.  No deviation gains zero, so the lower side is never negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from baselines.deviations import DeviationOptions, find_deviation, usual_deviations
from ppg_env.env import episodes as arena
from ppg_env.env.episodes import Episodes, mean_interval
from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from ppg_env.support.statistics import Interval

SELECTION, EVALUATION = 0, 1
"""Groups of episodes: in which the deviation is chosen, and in which it is evaluated."""


@dataclass(frozen=True)
class RegretBound:
    """Bounds on one agent's regret.

    Attributes
    ----------
    regret : the gain of the best deviation found, clipped at zero, with its interval; an estimate
        of a lower bound.
    most : an upper bound: the upper limit of the agent's mean cost less what it costs at least
        alone.
    deviation : the best one: ``grid``, ``planned``, ``trained`` or ``none``.
    gains : gain of each deviation, in the same episodes; may be negative.
    cost : the agent's mean cost without deviation, in these episodes.
    """

    regret: Interval
    most: float
    deviation: str
    gains: dict[str, Interval]
    cost: Interval


def regret_bounds(
    game: Game,
    players: Sequence[Player],
    *,
    deviations: Sequence[str] | None = None,
    agents: Sequence[int] | None = None,
    episodes: int = 50_000,
    seed: int = 0,
    rules: Rules | None = None,
    options: DeviationOptions | None = None,
) -> dict[int, RegretBound]:
    """Bound the regret of ``agents`` (all by default) when ``players`` play ``game``.

    Parameters
    ----------
    deviations
        Those to look for, by default ``grid`` and ``planned`` where the grid applies, else
        ``planned`` and ``trained``.
    episodes
        Episodes to choose a deviation, and as many to evaluate it.
    rules
        Of play, for all episodes.
    options
        What finding a deviation may cost; its seed is ``seed`` if None.

    Raises
    ------
    InputError
        If a deviation is unknown, or does not apply to the game.
    """
    names = usual_deviations(game, rules) if deviations is None else deviations
    chosen = options or DeviationOptions(seed=seed)

    def play(team: Sequence[Player]) -> list[Episodes]:
        groups = (SELECTION, EVALUATION)
        return [arena.evaluate(game, team, episodes, seed, group=g, rules=rules) for g in groups]

    now = play(players)
    bounds = {}
    for i in range(len(game.agents)) if agents is None else agents:
        gains: dict[str, list[np.ndarray]] = {}
        for name in names:
            deviation = find_deviation(name, game, i, players, chosen, rules)
            if deviation is None:
                continue
            others = [deviation if j == i else player for j, player in enumerate(players)]
            gains[name] = [
                before.cost[:, i] - after.cost[:, i]
                for before, after in zip(now, play(others), strict=True)
            ]
        bounds[i] = _bound(game, i, gains, now[EVALUATION], rules)
    return bounds


def _bound(
    game: Game, agent: int, gains: dict[str, list[np.ndarray]], now: Episodes, rules: Rules | None
) -> RegretBound:
    """Choose the deviation with the largest gain in the selection group."""
    evaluated = {name: mean_interval(both[EVALUATION]) for name, both in gains.items()}
    cost = mean_interval(now.cost[:, agent])
    most = _most(game, agent, cost, rules)
    best = max(gains, key=lambda name: float(gains[name][SELECTION].mean()), default="none")
    if best == "none" or gains[best][SELECTION].mean() <= 0:
        return RegretBound(Interval(0.0, 0.0, 0.0), most, "none", evaluated, cost)
    gain = evaluated[best]
    regret = Interval(*(max(limit, 0.0) for limit in (gain.value, gain.low, gain.high)))
    return RegretBound(regret, most, best, evaluated, cost)


def _most(game: Game, agent: int, cost: Interval, rules: Rules | None) -> float:
    """Return the upper limit of the cost less the proved cost of the agent alone."""
    from solvers.feedback.bounds.lower_bound import solo_lower_bound

    return max(cost.high - solo_lower_bound(game, agent, rules), 0.0)
