"""Feedback policies of one agent without others, by dynamic programming on a grid of its state.

The state has up to four components, such as those of a double integrator in the plane.  Crashes
with obstacles and arrivals have their Gaussian probabilities, as for two agents.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

import numpy as np

from ppg_env.env.players import Player, View
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from solvers.feedback.grid.backward import SPARE, STATIONARY, check_memory, check_time
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.feedback.grid.joint_model import FLOAT
from solvers.feedback.grid.single_kernels import decide, step_back, value_at
from solvers.feedback.grid.single_model import SingleModel, make_single_model
from solvers.feedback.grid.state_grid import MOST_AXES, padded


@dataclass(frozen=True, eq=False)
class SinglePolicy:
    """What the player of a solution needs: the fields (S, K), by the number of steps left."""

    model: SingleModel
    fields: np.ndarray

    def players(self) -> list[Player]:
        """Return the player."""
        return [SinglePlayer(self)]


class SinglePlayer:
    """Plays the agent of a solution from its own state and the clock."""

    information = "own state"

    def __init__(self, policy: SinglePolicy) -> None:
        self._policy = policy

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m)."""
        model, fields = self._policy.model, self._policy.fields
        agent = model.game.agents[0]
        action = np.zeros((len(view.clock), agent.control_dim))
        for clock in np.unique(view.clock).tolist():
            rows = np.flatnonzero((view.clock == clock) & view.in_traffic[:, 0])
            left = max(model.rules.steps(model.game) - clock, 1)
            chosen = np.zeros((rows.size, agent.control_dim))
            states = padded(view.state[rows, 0, : agent.state_dim], MOST_AXES)
            field = fields[min(left, len(fields)) - 1]
            decide(model.mover(clock), model.harm(clock), field, states, chosen)
            action[rows] = chosen
        return action


def solve_single(
    game: Game,
    rules: Rules,
    *,
    step: float | None,
    memory_limit: float,
    time_limit: float | None,
    progress: Callable[[int, int], None] | None,
) -> FeedbackSolution:
    """Return the policy of least expected cost; arguments are those of ``feedback_optimum``."""
    began = monotonic()
    model = make_single_model(game, rules, step)
    total, lam = rules.steps(game), float(game.agents[0].lam)
    needed = FLOAT * model.size * (total + SPARE)
    check_memory(needed, memory_limit)
    fields, value = np.empty((total, model.size), np.float32), np.zeros(model.size, np.float32)
    done, same = 0, False
    while done < total and not same:
        clock = total - 1 - done
        fields[done] = model.noise.traffic(value)
        step_back(model.mover(clock), model.harm(clock), fields[done], lam, value)
        same = done > 0 and model.clock_free
        same = same and float(np.abs(fields[done] - fields[done - 1]).max()) < STATIONARY
        done += 1
        if progress is not None:
            progress(done, total)
        check_time(began, time_limit, done, total)
    agent = game.agents[0]
    at_goal = np.array_equal(agent.start[: agent.goal.size], agent.goal)
    start = 0.0
    if not at_goal:
        start = float(value_at(model.mover(0), value, padded(agent.start, MOST_AXES)))
    return FeedbackSolution(
        game=game,
        rules=rules,
        kind="optimum",
        agents=(0,),
        value=(start,),
        step=model.step,
        stages=done,
        stationary=done < total,
        without_equilibrium=0.0,
        memory=needed,
        seconds=monotonic() - began,
        policy=SinglePolicy(model, fields[:done]),
    )
