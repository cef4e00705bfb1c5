"""Players turn observations into actions, for many copies of a game at once, without a solver.

A :class:`Player` plays one agent in all copies of a :class:`~ppg_env.env.simulator.Simulator` at
once.  It is given a :class:`View` of the game; its ``information`` declares how much of the view
it uses:

    open loop    the clock only
    own state    its own state and the clock
    full state   the states of all agents
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from ppg_env.errors import require
from ppg_env.game.effort_laws import goal_responses, least_effort_laws
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.plan import Plan, Profile
from ppg_env.game.polytope import Polytope

ADMISSIBLE = 1e-9
"""A control may leave its set by this much, in the agent's unit of controls."""


@dataclass(frozen=True)
class View:
    """What players may observe of C copies before a step.

    Attributes
    ----------
    observation : (C, W) float32, the agent's observation as the environment gives it.
    state : (C, N, n) states of all agents.
    in_traffic : (C, N) which agents are in traffic.
    parked : (C, N) which agents have arrived and stay in the way.
    obstacles : (C, K, d) positions of the moving obstacles, in the order of the game.
    clock : (C,) time of each copy.
    lam : (C, N) weights of time of all agents.
    goal : (C, N, n) goals, padded with zeros; None if they are those of the game in all copies.
    moved : (C,) whether a start or a goal is not the game's; None likewise.
    """

    observation: np.ndarray
    state: np.ndarray
    in_traffic: np.ndarray
    parked: np.ndarray
    obstacles: np.ndarray
    clock: np.ndarray
    lam: np.ndarray
    goal: np.ndarray | None = None
    moved: np.ndarray | None = None


class Player(Protocol):
    """Plays one agent; its ``information`` is ``open loop``, ``own state`` or ``full state``."""

    information: str

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m); those of copies in which the agent has ended are ignored."""
        ...


class Tracker:
    """Plays a plan with feedback: ubar_t - gain (x - xbar_t).

    After the plan's arrival it plays as :class:`GoToGoal`, and so it does from the start in copies
    in which starts or goals are not the game's, for which the plan is not made.
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
        self.plan = plan
        self._agent, self._mover = agent, mover
        self._end = game.horizon if plan.arrival is None else plan.arrival
        self._controls, self._means = plan.controls, plan.means
        self._go_to_goal = GoToGoal(game, agent)

    def act(self, view: View) -> np.ndarray:
        """Return the nominal control corrected by the gain, or a step to the goal after arrival."""
        t = np.minimum(view.clock, max(self._end - 1, 0))
        state = view.state[:, self._agent, : self._mover.state_dim]
        action = self._controls[t] - (state - self._means[t]) @ self._mover.gain.T
        late = view.clock >= self._end
        if view.moved is not None:
            late |= view.moved
        if late.any():
            goal = None if view.goal is None else view.goal[late, self._agent]
            action[late] = self._go_to_goal.towards_goal(state[late], view.clock[late], goal)
        return action


class GoToGoal:
    """Heads straight for the goal from its current state and ignores other agents.

    It plays the first control of the least-effort plan that reaches the goal in k steps, with the
    smallest k up to ``horizon`` for which that control is admissible now; if there is none, the
    one for the longest k (the environment projects it).
    """

    information = "own state"

    def __init__(self, game: Game, agent: int) -> None:
        self._agent, self._mover, self._horizon = agent, game.agents[agent], game.horizon
        self._sets = [
            (first, admissible, least_effort_laws(self._mover, game.horizon, admissible))
            for first, admissible in pieces(self._mover.control)
        ]

    @cached_property
    def _responses(self) -> list[list[np.ndarray]]:
        """How the laws of each set change with the goal."""
        mover, horizon = self._mover, self._horizon
        return [goal_responses(mover, horizon, admissible) for _, admissible, _ in self._sets]

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m) towards the goal."""
        state = view.state[:, self._agent, : self._mover.state_dim]
        goal = None if view.goal is None else view.goal[:, self._agent]
        return self.towards_goal(state, view.clock, goal)

    def towards_goal(
        self, state: np.ndarray, clock: np.ndarray, goal: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the first control (C, m) of the shortest least-effort plan from ``state`` (C, n).

        ``clock`` (C,) is the current step of each copy, ``goal`` (C, n) its goal if it is not the
        game's, padded with zeros.
        """
        shift = None if goal is None else goal[:, : self._mover.goal.size] - self._mover.goal
        action = np.empty((len(state), self._mover.control_dim))
        for k, (first, admissible, laws) in enumerate(self._sets):
            holds = clock >= first
            if k + 1 < len(self._sets):
                holds &= clock < self._sets[k + 1][0]
            slack = ADMISSIBLE * self._mover.control_unit
            if shift is not None:
                each = zip(laws, self._responses[k], strict=True)
                laws = [
                    (matrix, offset + shift @ response.T) for (matrix, offset), response in each
                ]
            _play(laws, admissible, slack, state, np.flatnonzero(holds), action)
        return action


def _play(
    laws: Sequence[tuple[np.ndarray, np.ndarray]],
    admissible: Polytope,
    slack: float,
    state: np.ndarray,
    undecided: np.ndarray,
    action: np.ndarray,
) -> None:
    """Write the control of the first law that is admissible into the rows ``undecided``.

    Offsets of laws are (m,), or (C, m) where goals differ.
    """
    for k, (matrix, offset) in enumerate(laws):
        own = offset if offset.ndim == 1 else offset[undecided]
        action[undecided] = state[undecided] @ matrix.T + own
        if k + 1 < len(laws):
            undecided = undecided[admissible.clearance(action[undecided]) > slack]
        if not undecided.size:
            break


def straight_players(game: Game) -> list[Player]:
    """Return a player per agent that tracks its straight plan, or goes to the goal without one."""
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return [
        GoToGoal(game, i) if plan is None else Tracker(game, i, plan)
        for i, plan in enumerate(plans)
    ]


def track(game: Game, profile: Profile) -> list[Player]:
    """Return a player per agent that tracks its plan of ``profile``."""
    return [Tracker(game, i, plan) for i, plan in enumerate(profile)]


def information(players: Sequence[Player]) -> str:
    """Return the richest information that any of ``players`` uses."""
    order = ("open loop", "own state", "full state")
    return max((player.information for player in players), key=order.index)
