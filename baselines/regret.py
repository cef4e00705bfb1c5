r"""Lower bounds on the regret of players, by deviations that gain.

    regret_i >= E[cost of i] - E[cost of i when it deviates]        for any deviation of i

Two deviations are evaluated for each agent, with the others' players unchanged:

    trained    PPO against the frozen others, from the player's own policy if it has one
    planned    the planner's best response to the others' mean behaviour, tracked

The better one is chosen on one group of episodes and evaluated on another, so that its interval is
unbiased; both sides have the same noise.  No deviation gains zero, so a bound is never negative.
It is a *lower* bound: a better deviation may exist.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from baselines.policy import LearnedPlayer
from ppg_env.env import episodes as arena
from ppg_env.env.episodes import mean_interval, trajectories
from ppg_env.env.players import Player, Tracker
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from ppg_env.scenarios.make import override_game
from ppg_env.support.frozen import frozen_array
from ppg_env.support.statistics import Interval
from solvers.budget import Budget
from solvers.equilibrium.best_response import respond
from solvers.liability import make_rule

SELECTION, EVALUATION = 0, 1
"""Groups of episodes: in which the deviation is chosen, and in which it is evaluated."""

MEAN_EPISODES = 2000
"""Episodes over which the others' behaviour is averaged for the planner."""


@dataclass(frozen=True)
class RegretBound:
    """A lower bound on one agent's regret.

    Attributes
    ----------
    regret : the gain of the better deviation, clipped at zero, with its interval.
    deviation : the better one: ``trained``, ``planned`` or ``none``.
    gains : gain of each deviation, in the same episodes; may be negative.
    """

    regret: Interval
    deviation: str
    gains: dict[str, Interval]


def regret_bounds(
    game: Game,
    players: Sequence[Player],
    *,
    agents: Sequence[int] | None = None,
    steps: int = 500_000,
    episodes: int = 50_000,
    seed: int = 0,
    solver: str = "ENGINE",
    time_limit: float | None = 60.0,
    tolerance: float | None = None,
) -> dict[int, RegretBound]:
    """Bound the regret of ``agents`` (all by default) from below when ``players`` play ``game``.

    Parameters
    ----------
    steps
        Environment steps to train each deviation; 0 trains none.  Training starts from the
        agent's own policy, if it is learned.
    episodes
        Episodes to choose a deviation, and as many to evaluate it.
    solver, time_limit
        Of the planner, see :func:`solvers.best_response`.
    tolerance
        Of arrival regions, see :class:`ppg_env.env.Rules`.
    """
    require(steps >= 0, "steps", f"is {steps}", "give a number of steps, zero or more")
    rules = Rules(tolerance=tolerance)
    mean = _mean_behaviour(game, players, rules, seed)

    def costs(team: Sequence[Player]) -> list[np.ndarray]:
        groups = (SELECTION, EVALUATION)
        return [
            arena.evaluate(game, team, episodes, seed, group=g, rules=rules).cost for g in groups
        ]

    now = costs(players)
    bounds = {}
    for i in range(len(game.agents)) if agents is None else agents:
        deviations = {}
        if steps:
            deviations["trained"] = _trained(game, i, players, steps, seed, tolerance)
        planned = _planned(game, i, mean, solver, time_limit)
        if planned is not None:
            deviations["planned"] = planned
        gains: dict[str, list[np.ndarray]] = {}
        for name, deviation in deviations.items():
            others = [deviation if j == i else player for j, player in enumerate(players)]
            gains[name] = [
                before[:, i] - after[:, i] for before, after in zip(now, costs(others), strict=True)
            ]
        bounds[i] = _chosen(gains)
    return bounds


def _chosen(gains: dict[str, list[np.ndarray]]) -> RegretBound:
    """Choose the deviation with the larger gain in the selection group."""
    evaluated = {name: mean_interval(both[EVALUATION]) for name, both in gains.items()}
    best = max(gains, key=lambda name: float(gains[name][SELECTION].mean()), default="none")
    if best == "none" or gains[best][SELECTION].mean() <= 0:
        return RegretBound(Interval(0.0, 0.0, 0.0), "none", evaluated)
    gain = evaluated[best]
    regret = Interval(*(max(limit, 0.0) for limit in (gain.value, gain.low, gain.high)))
    return RegretBound(regret, best, evaluated)


def _trained(
    game: Game,
    agent: int,
    players: Sequence[Player],
    steps: int,
    seed: int,
    tolerance: float | None,
) -> Player:
    """Train PPO for one agent against the unchanged others."""
    from baselines.ppo import COPIES, copy_policy, make_learner, player_of
    from baselines.training_loop import Args, Turn, take_turns
    from baselines.warm_start import imitate_go_to_goal

    lam, player = game.agents[agent].lam, players[agent]
    own = player.policy if isinstance(player, LearnedPlayer) else None
    conditioned = own is not None and own.conditioned
    weights = (lam, lam) if conditioned else None
    args = Args(game, "selfish", weights, seed, steps, tolerance=tolerance)
    learner = make_learner(args, [agent], copies=2 * COPIES)
    learner.env.players.update({j: player for j, player in enumerate(players) if j != agent})

    def prepare() -> None:
        if own is None or not copy_policy(own, learner):
            imitate_go_to_goal(learner.model, learner.env, seed)

    take_turns(args, [learner], [Turn(0, -(-steps // learner.rollout))], prepare=prepare)
    return player_of(args, learner, agent)


def _planned(
    game: Game, agent: int, mean: tuple[Plan, ...], solver: str, time_limit: float | None
) -> Player | None:
    """Plan the best response to the others' mean paths, at the environment's costs."""
    priced = override_game(game, objective="risk")
    solution = respond(make_rule(priced, "selfish"), agent, mean, solver, Budget(time_limit))
    return None if solution.profile is None else Tracker(game, agent, solution.profile[agent])


def _mean_behaviour(
    game: Game, players: Sequence[Player], rules: Rules, seed: int
) -> tuple[Plan, ...]:
    """Return all agents' mean paths while in traffic, as plans that end at the mean arrival."""
    # Crashed agents continue: the deviating agent needs the paths the others intended.
    going_on = replace(rules, on_crash="continue")
    states = trajectories(game, players, MEAN_EPISODES, seed, group=SELECTION, rules=going_on)
    plans = []
    for i, agent in enumerate(game.agents):
        path = states[:, :, i, : agent.state_dim]
        there = np.isfinite(path[:, :, 0])
        left = round(float(there.sum(axis=1).mean())) - 1
        counts = np.maximum(there.sum(axis=0), 1)[:, None]
        mean = np.where(there[:, :, None], path, 0.0).sum(axis=0) / counts
        last = min(max(left, 0), game.horizon)
        rows = np.minimum(np.arange(game.horizon + 1), min(last, len(mean) - 1))
        plans.append(
            Plan(
                frozen_array(np.zeros((game.horizon, agent.control_dim))),
                frozen_array(mean[rows]),
                last,
            )
        )
    return tuple(plans)
