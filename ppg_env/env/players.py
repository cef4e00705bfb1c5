"""Players: whatever turns observations into actions, over batches, without a solver.

A :class:`Player` plays one agent in all copies of a :class:`~ppg_env.env.simulator.Simulator` at
once.  It is given a :class:`View`, which holds all that any player could want to know; the
``information`` that it declares says how much of that it uses:

    open loop    the clock only
    own state    its own state and the clock
    full state   everybody's state
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.input_sets import clearance
from ppg_env.game.least_effort import least_effort_laws, straight_plan
from ppg_env.game.plan import Plan, Profile


@dataclass(frozen=True)
class View:
    """What may be seen of C copies before a step.

    Attributes
    ----------
    observation : (C, W) float32, the agent's observation as the environment gives it.
    state : (C, N, n) everybody's state.
    in_traffic : (C, N) who is on the way.
    clock : (C,) time of each copy.
    lam : (C, N) everybody's weight of time.
    """

    observation: np.ndarray
    state: np.ndarray
    in_traffic: np.ndarray
    clock: np.ndarray
    lam: np.ndarray


class Player(Protocol):
    """Plays one agent; ``information`` is ``open loop``, ``own state`` or ``full state``."""

    information: str

    def act(self, view: View) -> np.ndarray:
        """Actions (C, m); those for copies in which the agent has ended are ignored."""
        ...


class Tracker:
    """Plays a plan: ubar_t - gain (x - xbar_t); once the plan has run out, it homes.

    GoToGoal plays the least-effort step towards the goal, as :class:`GoToGoal` does.
    """

    def __init__(self, game: Game, agent: int, plan: Plan) -> None:
        mover = game.agents[agent]
        require(
            plan.controls.shape == (game.horizon, mover.control_dim),
            "plan",
            "does not fit the agent",
            "give a plan of this game",
        )
        self.information = "own state" if np.any(mover.gain) else "open loop"
        self._agent, self._mover = agent, mover
        self._end = game.horizon if plan.arrival is None else plan.arrival
        self._controls, self._means = plan.controls, plan.means
        self._homing = GoToGoal(game, agent)

    def act(self, view: View) -> np.ndarray:
        """Nominal control corrected by the gain, or a step home after the plan's arrival."""
        t = np.minimum(view.clock, max(self._end - 1, 0))
        state = view.state[:, self._agent, : self._mover.state_dim]
        action = self._controls[t] - (state - self._means[t]) @ self._mover.gain.T
        late = view.clock >= self._end
        if late.any():
            action[late] = self._homing.towards_goal(state[late], view.clock[late])
        return action


class GoToGoal:
    """Heads straight for the goal from wherever it is, and ignores everybody.

    It plays the first control of the least-effort plan that reaches the goal in k steps, with the
    smallest k up to ``horizon`` for which that control is admissible now; if there is none, the
    one for the longest k (the environment projects it).
    """

    information = "own state"

    def __init__(self, game: Game, agent: int) -> None:
        self._agent, self._mover = agent, game.agents[agent]
        self._laws = least_effort_laws(self._mover, game.horizon)

    def act(self, view: View) -> np.ndarray:
        """Actions (C, m) towards the goal."""
        state = view.state[:, self._agent, : self._mover.state_dim]
        return self.towards_goal(state, view.clock)

    def towards_goal(self, state: np.ndarray, clock: np.ndarray) -> np.ndarray:
        """First control (C, m) of the shortest least-effort plan home from ``state`` (C, n).

        ``clock`` (C,) is the step that each copy is at.
        """
        action, waiting = np.empty((len(state), self._mover.control_dim)), np.arange(len(state))
        for k, (matrix, offset) in enumerate(self._laws):
            action[waiting] = state[waiting] @ matrix.T + offset
            if k + 1 < len(self._laws):
                beyond = clearance(self._mover.control, action[waiting], clock[waiting])
                waiting = waiting[beyond > 1e-9]
            if not waiting.size:
                break
        return action


def straight_players(game: Game) -> list[Player]:
    """Everybody tracks its straight plan; those without one home."""
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return [
        GoToGoal(game, i) if plan is None else Tracker(game, i, plan)
        for i, plan in enumerate(plans)
    ]


def track(game: Game, profile: Profile) -> list[Player]:
    """Everybody tracks its plan of ``profile``."""
    return [Tracker(game, i, plan) for i, plan in enumerate(profile)]


def information(players: Sequence[Player]) -> str:
    """The richest information that any of ``players`` uses, for tables."""
    order = ("open loop", "own state", "full state")
    return max((player.information for player in players), key=order.index)
