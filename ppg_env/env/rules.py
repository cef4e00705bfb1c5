"""Rules of play: what ends an agent's episode, and which reward it gets.

==========================  ======================================================================
option                      meaning
==========================  ======================================================================
``arrival="region"``        an agent arrives when its state is within ``tolerance`` of its goal
``arrival="schedule"``      agent i arrives at time ``schedule[i]``, wherever it is (the paper's
                            T_i)
``on_goal="remove"``        an arrived agent leaves the game and its body is removed
``on_goal="stay"``          its body stays parked where it arrived; others may still crash into it
``on_crash="remove"``       crashed agents leave the game
``on_crash="continue"``     they go on; every step that ends in an overlap is a crash
``reward="risk"``           -lam per step in traffic, -(1 - lam) kappa at a crash
``reward="margin"``         -lam - (1 - lam) sum (M' - s) per step in traffic, s at realised
                            positions
``sharing="selfish"``       each agent gets its own reward
``sharing="social"``        each agent gets the sum of all rewards, to the end of the episode
``saturation="clip"``       inputs are projected on the control set
``saturation="none"``       inputs are taken as they are
==========================  ======================================================================

In a step all agents in traffic move; then arrivals are settled; then collisions among the
remaining bodies.  Margins count agents in traffic only, with the covariances that the game plans
with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.game.game import Game

CHOICES = {
    "arrival": ("region", "schedule"),
    "on_goal": ("remove", "stay"),
    "on_crash": ("remove", "continue"),
    "reward": ("risk", "margin"),
    "sharing": ("selfish", "social"),
    "saturation": ("clip", "none"),
}

TOLERANCE = 5.0
"""Half side of the arrival region, a box around the goal: half a step at the default speed, 3.6
standard deviations of one step's default noise."""


@dataclass(frozen=True)
class Rules:
    """The rules of play; the module's table lists the choices.

    Attributes
    ----------
    tolerance : largest distance per component from the goal at arrival, for ``region``.
    schedule : (N,) arrival times, for ``schedule``.
    max_cycles : steps after which the episode is truncated; None for twice the horizon.
    """

    arrival: str = "region"
    on_goal: str = "remove"
    on_crash: str = "remove"
    reward: str = "risk"
    sharing: str = "selfish"
    saturation: str = "clip"
    tolerance: float = TOLERANCE
    schedule: tuple[int, ...] | None = None
    max_cycles: int | None = None

    def __post_init__(self) -> None:
        for key, allowed in CHOICES.items():
            value = getattr(self, key)
            require(
                isinstance(value, str) and value in allowed,
                key,
                f"is {value!r}",
                "write " + " or ".join(allowed),
            )
        number = isinstance(self.tolerance, (int, float)) and not isinstance(self.tolerance, bool)
        require(
            number and 0 <= self.tolerance < float("inf"),
            "tolerance",
            f"is {self.tolerance!r}",
            "write a length, zero or more",
        )
        require(
            self.max_cycles is None or _whole(self.max_cycles, 1),
            "max_cycles",
            f"is {self.max_cycles!r}",
            "write a whole number of steps, 1 or more",
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
            raise InputError(key, "is not an option", "use one of " + ", ".join(names))
    rules = Rules(**options)
    if rules.schedule is not None:
        require(
            len(rules.schedule) == len(game.agents),
            "schedule",
            f"has {len(rules.schedule)} times for {len(game.agents)} agents",
            "give one per agent",
        )
    return rules


def _whole(value: Any, least: int) -> bool:
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    return bool(whole and value >= least)
