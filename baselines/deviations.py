r"""Deviations of one agent from players that stay as they are: each tries to lower its own cost.

    grid       the best response by dynamic programming on a grid of the joint state, finer than
               that of the other player's policy if it has one
    planned    the planner's best response to the others' mean behaviour, tracked
    trained    PPO against the frozen others, from the player's own policy if it has one

``grid`` sees all agents and the clock, and applies to games whose joint state has at most four
dimensions (:func:`solvers.feedback.grid.extent.dynamic_programming_applies`).  In other games it
sees its own state and the clock, and the others must track plans.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from baselines.policy import LearnedPlayer
from ppg_env.env.episodes import trajectories
from ppg_env.env.players import Player, Tracker
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from ppg_env.scenarios.make import override_game
from ppg_env.support.frozen import frozen_array
from solvers.budget import Budget
from solvers.equilibrium.best_response import respond
from solvers.feedback.grid.extent import dynamic_programming_applies
from solvers.liability import make_rule

MEAN_EPISODES = 2000
"""Episodes over which the others' behaviour is averaged for the planner."""

MEAN_GROUP = 0
"""Group of these episodes."""


@dataclass(frozen=True)
class DeviationOptions:
    """What finding a deviation may cost.

    Attributes
    ----------
    steps : environment steps to train ``trained``.
    seed : of the training, and of the episodes that ``planned`` averages.
    solver, time_limit : of the planner, see :func:`solvers.best_response`; ``time_limit`` also
        bounds ``grid``.
    memory_limit, progress : of ``grid``, see :func:`solvers.best_feedback_response`.
    """

    steps: int = 500_000
    seed: int = 0
    solver: str = "ENGINE"
    time_limit: float | None = 60.0
    memory_limit: float | None = None
    progress: Callable[[int, int], None] | None = None

    def __post_init__(self) -> None:
        require(self.steps >= 1, "steps", f"is {self.steps}", "give a number of steps, 1 or more")


def usual_deviations(game: Game, rules: Rules | None = None) -> tuple[str, ...]:
    """Return the deviations that are looked for by default."""
    grid = dynamic_programming_applies(game, rules)
    return ("grid", "planned") if grid else ("planned", "trained")


def check_deviation(name: str | None, place: str = "deviation") -> None:
    """Refuse a name that is none of :data:`DEVIATIONS`; None is no choice."""
    require(
        name is None or name in DEVIATIONS,
        place,
        f"is {name!r}",
        "write " + " or ".join(DEVIATIONS),
    )


def find_deviation(
    name: str,
    game: Game,
    agent: int,
    players: Sequence[Player],
    options: DeviationOptions,
    rules: Rules | None = None,
) -> Player | None:
    """Return a player for ``agent`` that deviates from ``players``; None if the planner has none.

    Raises
    ------
    InputError
        If ``name`` is unknown, or ``grid`` does not apply to the game.
    """
    check_deviation(name)
    return DEVIATIONS[name](game, agent, players, options, rules or Rules())


def _by_grid(
    game: Game, agent: int, players: Sequence[Player], options: DeviationOptions, rules: Rules
) -> Player | None:
    """Compute the best response by dynamic programming."""
    from solvers.feedback.grid.dynamic_programming import MEMORY_LIMIT, best_feedback_response

    return best_feedback_response(
        game, agent, players, rules,
        memory_limit=options.memory_limit or MEMORY_LIMIT,
        time_limit=options.time_limit,
        progress=options.progress,
    ).player  # fmt: skip


def _trained(
    game: Game, agent: int, players: Sequence[Player], options: DeviationOptions, rules: Rules
) -> Player:
    """Train PPO for one agent against the unchanged others."""
    from baselines.ppo import COPIES, copy_policy, make_learner, player_of
    from baselines.training_loop import Args, Turn, take_turns
    from baselines.warm_start import imitate_go_to_goal

    lam, player = game.agents[agent].lam, players[agent]
    own = player.policy if isinstance(player, LearnedPlayer) else None
    conditioned = own is not None and own.conditioned
    limits = (lam, lam) if conditioned else None
    args = Args(game, "selfish", limits, options.seed, options.steps, tolerance=rules.tolerance)
    learner = make_learner(args, [agent], copies=2 * COPIES)
    learner.env.players.update({j: player for j, player in enumerate(players) if j != agent})

    def prepare() -> None:
        if own is None or not copy_policy(own, learner):
            imitate_go_to_goal(learner.model, learner.env, options.seed)

    take_turns(args, [learner], [Turn(0, -(-options.steps // learner.rollout))], prepare=prepare)
    return player_of(args, learner, agent)


def _planned(
    game: Game, agent: int, players: Sequence[Player], options: DeviationOptions, rules: Rules
) -> Player | None:
    """Plan the best response to the others' mean paths, at the environment's costs."""
    mean = _mean_behaviour(game, players, rules, options.seed)
    rule = make_rule(override_game(game, objective="risk"), "selfish")
    solution = respond(rule, agent, mean, options.solver, Budget(options.time_limit))
    return None if solution.profile is None else Tracker(game, agent, solution.profile[agent])


def _mean_behaviour(
    game: Game, players: Sequence[Player], rules: Rules, seed: int
) -> tuple[Plan, ...]:
    """Return all agents' mean paths while in traffic, as plans that end at the mean arrival."""
    # Crashed agents continue: the deviating agent needs the paths the others intended.
    going_on = replace(rules, on_crash="continue")
    states = trajectories(game, players, MEAN_EPISODES, seed, group=MEAN_GROUP, rules=going_on)
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


DEVIATIONS: dict[
    str, Callable[[Game, int, Sequence[Player], DeviationOptions, Rules], Player | None]
] = {"grid": _by_grid, "planned": _planned, "trained": _trained}
"""The functions that find each deviation."""
