"""Rules of play: what ends an agent's episode, and which reward it gets.

==========================  ======================================================================
option                      meaning
==========================  ======================================================================
``arrival="region"``        an agent arrives when its state is within ``tolerance`` of its goal:
                            by default half of its longest step, per component
                            (:mod:`ppg_env.env.arrival_regions`)
``arrival="schedule"``      agent i arrives at time ``schedule[i]``, wherever it is (the paper's
                            T_i)
``on_goal="remove"``        an arrived agent leaves the game and its body is removed
``on_goal="stay"``          its body stays parked where it arrived; others may still crash into
                            it.  The default is the game's own ``on_goal``
``on_crash="remove"``       crashed agents leave the game
``on_crash="continue"``     they go on; every step with an overlap is a crash
``reward="risk"``           -lam per step in traffic, -(1 - lam) kappa at a crash
``reward="margin"``         -lam per step in traffic, -(1 - lam) (M' - s) per step and encounter
                            in traffic, s at realised positions
``sharing="selfish"``       each agent gets its own reward
``sharing="social"``        each agent gets the sum of all rewards, to the end of the episode
``saturation="clip"``       inputs are projected on the control set
``saturation="none"``       inputs are taken as they are
==========================  ======================================================================

The game's ``objective`` is for planners and changes nothing here: ``reward`` alone decides what
agents get.

In a step all agents in traffic move; then arrivals are settled; then collisions.  A pair is in
traffic until one of its agents has arrived, or with ``stay`` until both have; a pair of parked
bodies never collides.  Margins s are those of encounters in traffic, with the covariances that
the game plans with.

What a collision is depends on the game's ``collisions``:

``instants``
    two bodies overlap after the step; agents that arrived in it no longer count (with ``stay``:
    not against each other and parked bodies).  s is the margin before the step.
``swept``
    two bodies overlap at some time of the step, in which all of them move on straight lines: the
    segment from the displacement before to that after the step meets the collision set.  An
    arriving body counts up to its arrival: if it crashes in that step, with ``on_crash="remove"``,
    it does not arrive.  s is the margin of the step.

Touching is no overlap (:mod:`ppg_env.game.compiled_margins`).

Obstacles on paths move with the clock, and rest at the last position.  One with noise drifts: it
is displaced by a random walk until it rests.  From its ``until`` on it is gone.  Where bodies stay,
an episode goes on until no obstacle moves that could hit a parked body.

Each step of an agent costs its ``effort`` as well, times the sum of the absolute values of the
inputs that are applied.  Without noise and on schedule the return for ``margin`` is minus the
plan's shifted cost.  With noise, feedback adds to the effort: on average it costs as much as
planned, or more.

Only means are bound by ``within``: realised states may leave the workspace, which infos report.
Nor do ``reserve`` and ``within`` change what the environment does with an input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.formats.keys import nearest
from ppg_env.game.game import Game
from ppg_env.support.validation import is_whole

CHOICES = {
    "arrival": ("region", "schedule"),
    "on_goal": ("remove", "stay"),
    "on_crash": ("remove", "continue"),
    "reward": ("risk", "margin"),
    "sharing": ("selfish", "social"),
    "saturation": ("clip", "none"),
}

LONGEST = 2**31 - 2
"""The largest number of steps: below the time of arrival of agents that have not arrived."""


@dataclass(frozen=True)
class Rules:
    """The rules of play; the module's table lists the choices.

    Attributes
    ----------
    on_goal : what becomes of arrived bodies; None for the game's own ``on_goal``.
    tolerance : largest distance per component from the goal at arrival, for ``region``; None for
        half of an agent's longest step, per component.
    schedule : (N,) arrival times, for ``schedule``.
    max_cycles : steps after which the episode is truncated; None for twice the horizon.
    """

    arrival: str = "region"
    on_goal: str | None = None
    on_crash: str = "remove"
    reward: str = "risk"
    sharing: str = "selfish"
    saturation: str = "clip"
    tolerance: float | None = None
    schedule: tuple[int, ...] | None = None
    max_cycles: int | None = None

    def __post_init__(self) -> None:
        for key, allowed in CHOICES.items():
            value = getattr(self, key)
            if key == "on_goal" and value is None:
                continue
            require(
                isinstance(value, str) and value in allowed,
                key,
                f"is {value!r}",
                "write " + " or ".join(allowed),
            )
        require(
            self.tolerance is None or _length(self.tolerance),
            "tolerance",
            f"is {self.tolerance!r}",
            "write a length, zero or more",
        )
        require(
            self.max_cycles is None or _whole(self.max_cycles, 1),
            "max_cycles",
            f"is {self.max_cycles!r}",
            f"write a whole number of steps from 1 to {LONGEST}",
        )
        self._check_schedule()

    def _check_schedule(self) -> None:
        if self.schedule is None:
            require(
                self.arrival == "region",
                "schedule",
                "is missing",
                "give one arrival time per agent, such as a plan's",
            )
            return
        require(
            self.arrival == "schedule",
            "schedule",
            "is given although arrival is 'region'",
            "leave it out, or set arrival to 'schedule'",
        )
        sequence = isinstance(self.schedule, (Sequence, np.ndarray))
        fits = sequence and all(_whole(t, 0) for t in self.schedule)
        require(fits, "schedule", f"is {self.schedule!r}", "give one whole number per agent")
        object.__setattr__(self, "schedule", tuple(int(t) for t in self.schedule))

    def of(self, game: Game) -> Rules:
        """Return the rules with ``on_goal`` as the game has it, where it is None."""
        return self if self.on_goal is not None else replace(self, on_goal=game.on_goal)

    def steps(self, game: Game) -> int:
        """Return the largest number of steps of an episode."""
        return 2 * game.horizon if self.max_cycles is None else self.max_cycles


def make_rules(game: Game, **options: Any) -> Rules:
    """Return the rules from keyword options, checked against the game.

    Raises
    ------
    InputError
        If an option is unknown, has a wrong value, or does not fit the number of agents.
    """
    names = [field.name for field in fields(Rules)]
    for key in options:
        if key not in names:
            raise InputError(key, "is not an option", nearest(key, names))
    rules = Rules(**options)
    if rules.schedule is not None:
        require(
            len(rules.schedule) == len(game.agents),
            "schedule",
            f"has {len(rules.schedule)} times for {len(game.agents)} agents",
            "give one per agent",
        )
    return rules


def _length(value: Any) -> bool:
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    return bool(number and 0 <= value <= tol.LARGEST)


def _whole(value: Any, least: int) -> bool:
    whole = is_whole(value)
    return bool(whole and least <= value <= LONGEST)
