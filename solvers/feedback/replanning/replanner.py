"""Players that plan again for all agents at every step, from the observed states.

A decision is a joint plan for all agents in traffic, of which each player plays its own first
input.  Plans are chosen among many candidates by their expected costs
(:mod:`solvers.feedback.replanning.search`); the earlier plan, and the plan that would be tracked,
are among them.

``social``  the sum of all costs falls
``nash``    each agent responds to the plans of the others with its own cost
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ppg_env.env.arrays import make_tables
from ppg_env.env.players import Player, View
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.feedback.replanning.meetings import make_meetings
from solvers.feedback.replanning.motion import make_motion


class JointReplanner:
    """Plans for all agents; players of the same game share one, so that each step is planned once.

    Parameters
    ----------
    game, profile
        The game, and the plans to fall back on.
    social
        Whether the sum of costs counts, or each agent's own.
    rules
        The rules of play, of which the arrival region and what becomes of arrived bodies count.
    """

    def __init__(
        self, game: Game, profile: Profile, *, social: bool, rules: Rules | None = None
    ) -> None:
        require(
            len(profile) == len(game.agents)
            and all(len(plan.controls) == game.horizon for plan in profile),
            "profile",
            "does not fit the game",
            "give one plan of this game per agent",
        )
        self.game, self.social = game, social
        tables = make_tables(game, (Rules() if rules is None else rules).of(game))
        self._motion = make_motion(game, tables, profile)
        self._meetings = make_meetings(game, tables)
        self._shape = (len(game.agents), game.horizon, tables.limits.shape[2])
        self._state = np.zeros((0, 0, 0))
        self._traffic = np.zeros((0, 0), dtype=bool)
        self._lam = np.zeros((0, 0))
        self._clock = np.zeros(0, dtype=np.int64)
        self._kept = np.zeros((0, *self._shape))
        self._steps = np.zeros((0, self._shape[0]), dtype=np.int64)
        self._action = np.zeros((0, 0, 0))

    def plan(self, view: View) -> np.ndarray:
        """Return the first inputs (C, N, m) of all agents in traffic."""
        if self._is_known(view):
            return self._action
        from solvers.feedback.replanning.search import plan

        self._shift(view)
        self._action = np.zeros((len(view.clock), self._shape[0], self._shape[2]))
        self._state, self._traffic = view.state.copy(), view.in_traffic.copy()
        self._clock, self._lam = view.clock.copy(), view.lam.copy()
        plan(
            self._motion, self._meetings, self.social, self._state, self._traffic,
            view.parked, np.ascontiguousarray(view.obstacles), self._clock,
            self._lam, self._kept, self._steps, self._action,
        )  # fmt: skip
        return self._action

    def _is_known(self, view: View) -> bool:
        return (
            np.array_equal(view.clock, self._clock)
            and np.array_equal(view.in_traffic, self._traffic)
            and np.array_equal(view.lam, self._lam)
            and np.array_equal(view.state, self._state, equal_nan=True)
        )

    def _shift(self, view: View) -> None:
        """Let earlier plans start at the present step; drop those of other episodes."""
        copies, (agents, steps, _) = len(view.clock), self._shape
        if copies != len(self._clock):
            self._kept = np.zeros((copies, *self._shape))
            self._steps = np.zeros((copies, agents), dtype=np.int64)
            return
        passed = view.clock - self._clock
        for gap in np.unique(passed):
            rows = np.flatnonzero(passed == gap)
            if 0 < gap < steps:
                kept = self._kept[rows]
                self._kept[rows, :, :-gap] = kept[:, :, gap:]
                self._kept[rows, :, -gap:] = 0.0
                self._steps[rows] = np.maximum(self._steps[rows] - gap, 0)
            else:
                self._steps[rows] = 0


class Replanner:
    """Plays one agent's part in the plans of a :class:`JointReplanner`."""

    information = "full state"

    def __init__(self, joint: JointReplanner, agent: int) -> None:
        self._joint, self._agent = joint, agent
        self._inputs = joint.game.agents[agent].control_dim

    def act(self, view: View) -> np.ndarray:
        """Return the actions (C, m) of this player's agent."""
        return self._joint.plan(view)[:, self._agent, : self._inputs]


def replanning(
    game: Game, profile: Profile, *, social: bool, rules: Rules | None = None
) -> Sequence[Player]:
    """Return a player per agent that plans again for all agents at every step.

    See :class:`JointReplanner`.
    """
    joint = JointReplanner(game, profile, social=social, rules=rules)
    return [Replanner(joint, i) for i in range(len(game.agents))]
