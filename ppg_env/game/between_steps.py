r"""Overlaps of the means between two time steps, which ``collisions="instants"`` does not count.

From t to t + 1 the displacement r_i - r_j of two means runs along a segment x + u (y - x), with u
from 0 to 1.  Its depth in the collision set K,

    depth(u) = min_p (b_p - a_p' (x + u (y - x))),

is a minimum of lines, so its maximum lies at an end, or where a rising and a falling line cross:
it is found exactly, without sampling.

A step counts while its encounter is in traffic: an arriving body up to its arrival, a parked one
(``on_goal="stay"``) until both are parked.  A step with an overlap at one of its ends is left out
if that end is a time step in traffic: the game counts that overlap itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import end_of_traffic, mean_displacements
from ppg_env.game.plan import Profile

OVERLAP_TIMES = {"instants": "at the time steps", "swept": "during the steps"}
"""The times at which an overlap is a crash, by the rule of collisions, in words."""


@dataclass(frozen=True)
class StepOverlap:
    """The deepest overlap of two means between two time steps.

    Attributes
    ----------
    parties : names of the two bodies: two agents, or an agent and ``obstacle k``.
    agents : (i, j) with i < j, or (i,) with an obstacle.
    obstacle : index of the obstacle, None for a pair of agents.
    step : t, for the way from t to t + 1.
    moment : u, the share of the step after which the overlap is deepest, 0 <= u <= 1.
    depth : distance by which the bodies would have to move apart then.
    place : (d,) the point half-way between the two means then; the agent's mean with an obstacle.
    """

    parties: tuple[str, str]
    agents: tuple[int, ...]
    obstacle: int | None
    step: int
    moment: float
    depth: float
    place: tuple[float, ...]

    def __str__(self) -> str:
        """Return who overlaps, when, and how deep."""
        return (
            f"between steps {self.step} and {self.step + 1} the means of "
            f"{' and '.join(self.parties)} overlap by {self.depth:.3g}"
        )


def overlaps_between_steps(game: Game, profile: Profile) -> tuple[StepOverlap, ...]:
    """Return where the means of ``profile`` pass through something between two time steps.

    There is one entry for each encounter that overlaps so, for its deepest step; the deepest entry
    comes first.  It is the largest depth(u) = min_p (b_p - a_p' (x + u (y - x))) over 0 <= u <= 1,
    where x and y are the displacements of the means at t and t + 1 in the collision set with unit
    normals a_p and offsets b_p.  Overlaps at the time steps in traffic are not included; the end of
    an arriving agent's last step is.  Depths up to ``tolerances.LENGTH`` count as touching.

    A profile that is feasible with ``collisions="swept"`` has none.
    """
    displacements = mean_displacements(game, profile)
    overlaps = [
        overlap
        for encounter, where in zip(game.encounters, displacements, strict=True)
        if (overlap := _deepest_step(game, profile, encounter, where)) is not None
    ]
    return tuple(sorted(overlaps, key=lambda overlap: -overlap.depth))


def _deepest_step(
    game: Game, profile: Profile, encounter: Encounter, displacements: np.ndarray
) -> StepOverlap | None:
    """Return the deepest overlap between time steps of one encounter, None if there is none."""
    collision = encounter.collision
    depths = collision.offsets - displacements @ collision.normals.T  # (H+1, F)
    end = end_of_traffic(game, encounter, [plan.arrival for plan in profile])
    instants = (np.arange(game.horizon + 1) < end) & (depths.min(axis=1) > tol.LENGTH)
    # A face that is clear at both ends is clear in between.
    inside = np.maximum(depths[:-1], depths[1:]).min(axis=1) > tol.LENGTH
    inside[end:] = False
    steps = np.flatnonzero(inside & ~instants[:-1] & ~instants[1:])
    deepest = max(((deepest_point(depths[t], depths[t + 1]), t) for t in steps), default=None)
    if deepest is None or deepest[0][0] <= tol.LENGTH:
        return None
    (depth, moment), step = deepest
    return StepOverlap(
        parties=_parties(game, encounter),
        agents=encounter.agents,
        obstacle=encounter.obstacle,
        step=int(step),
        moment=moment,
        depth=depth,
        place=_place(game, profile, encounter, step + moment),
    )


def deepest_point(first: np.ndarray, last: np.ndarray) -> tuple[float, float]:
    """Return the largest depth on the segment between two points, and where it is attained.

    ``first`` and ``last`` (F,) are the depths below each face at its ends.  Two lines, one that
    rises and one that falls, bound the maximum; the lowest line where they cross replaces one of
    them until it is one of them.
    """
    slopes = last - first
    rising = min(range(len(slopes)), key=lambda p: (first[p], slopes[p]))
    falling = min(range(len(slopes)), key=lambda p: (last[p], -slopes[p]))
    if slopes[rising] <= 0:
        return float(first[rising]), 0.0
    if slopes[falling] >= 0:
        return float(last[falling]), 1.0
    for _ in slopes:
        moment = (first[falling] - first[rising]) / (slopes[rising] - slopes[falling])
        depths = first + moment * slopes
        lowest = int(depths.argmin())
        if slopes[lowest] == 0 or depths[lowest] >= min(depths[rising], depths[falling]):
            break
        if slopes[lowest] > 0:
            rising = lowest
        else:
            falling = lowest
    return float(depths[lowest]), float(moment)


def overlap_times(game: Game) -> str:
    """Return the times at which an overlap is a crash, in words."""
    return OVERLAP_TIMES[game.collisions]


def _parties(game: Game, encounter: Encounter) -> tuple[str, str]:
    names = [game.agent_names[i] for i in encounter.agents]
    return names[0], names[1] if encounter.obstacle is None else f"obstacle {encounter.obstacle}"


def _place(game: Game, profile: Profile, encounter: Encounter, time: float) -> tuple[float, ...]:
    times = np.arange(game.horizon + 1)
    means = np.mean([profile[i].means[:, : game.dim] for i in encounter.agents], axis=0)
    return tuple(float(np.interp(time, times, component)) for component in means.T)
