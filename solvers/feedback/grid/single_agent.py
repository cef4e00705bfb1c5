"""Feedback policies of one agent from its own state, by dynamic programming on a grid of it.

The state has up to four components, such as those of a double integrator in the plane.  Crashes
with obstacles and arrivals have their Gaussian probabilities, as for two agents.  Other agents may
follow plans: they are bodies on paths, and what the noise does to them is not observed
(:mod:`solvers.feedback.grid.frozen_bodies`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import monotonic

import numpy as np

from ppg_env.env.players import Player, View
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from solvers.feedback.grid.backward import SPARE, check_memory, check_time
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.feedback.grid.frozen_bodies import followed_plans, frozen_bodies
from solvers.feedback.grid.joint_model import FLOAT
from solvers.feedback.grid.single_backward import single_stages
from solvers.feedback.grid.single_kernels import decide, value_at
from solvers.feedback.grid.single_model import SingleModel, make_single_model
from solvers.feedback.grid.state_grid import MOST_AXES, padded


@dataclass(frozen=True, eq=False)
class SinglePolicy:
    """What the player of a solution needs: the fields (S, K), by the number of steps left."""

    model: SingleModel
    fields: np.ndarray
    others: dict[int, Player]

    def players(self) -> list[Player]:
        """Return one player per agent."""
        every = self.others | {self.model.agent: SinglePlayer(self)}
        return [every[i] for i in sorted(every)]


class SinglePlayer:
    """Plays the agent that was solved for from its own state and the clock."""

    information = "own state"

    def __init__(self, policy: SinglePolicy) -> None:
        self._policy = policy

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m)."""
        model, fields = self._policy.model, self._policy.fields
        agent, own = model.own, model.agent
        action = np.zeros((len(view.clock), agent.control_dim))
        for clock in np.unique(view.clock).tolist():
            rows = np.flatnonzero((view.clock == clock) & view.in_traffic[:, own])
            left = max(model.rules.steps(model.game) - clock, 1)
            chosen = np.zeros((rows.size, agent.control_dim))
            states = padded(view.state[rows, own, : agent.state_dim], MOST_AXES)
            field = fields[min(left, len(fields)) - 1]
            decide(model.mover(clock), model.harm(clock), field, states, chosen)
            action[rows] = chosen
        return action


def solve_single(
    game: Game,
    rules: Rules,
    agent: int,
    players: Sequence[Player],
    *,
    step: float | None,
    memory_limit: float,
    time_limit: float | None,
    progress: Callable[[int, int], None] | None,
) -> FeedbackSolution:
    """Return the policy of least expected cost of ``agent``.

    The others of ``players`` follow plans; other arguments are those of ``feedback_optimum``.
    """
    began = monotonic()
    others = {j: player for j, player in enumerate(players) if j != agent}
    bodies = frozen_bodies(game, agent, followed_plans(others))
    model = make_single_model(game, rules, agent, bodies, step)
    total = rules.steps(game)
    needed = FLOAT * model.size * (total + SPARE)
    check_memory(needed, memory_limit)
    fields, value, done = np.empty((total, model.size), np.float32), np.empty(0), 0
    for done, (field, costs) in enumerate(single_stages(model), 1):
        fields[done - 1], value = field, costs
        if progress is not None:
            progress(done, total)
        check_time(began, time_limit, done, total)
    own, start = model.own, 0.0
    if not np.array_equal(own.start[: own.goal.size], own.goal):
        start = float(value_at(model.mover(0), value, padded(own.start, MOST_AXES)))
    return FeedbackSolution(
        game=game,
        rules=rules,
        kind="response" if others else "optimum",
        agents=(agent,),
        value=(start,),
        step=model.step,
        stages=done,
        stationary=done < total,
        without_equilibrium=0.0,
        memory=needed,
        seconds=monotonic() - began,
        policy=SinglePolicy(model, fields[:done], others),
    )
