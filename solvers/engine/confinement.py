"""Single movers among walls: whether ways are looked for first, and how early they arrive."""

from __future__ import annotations

from collections.abc import Mapping

from ppg_env.game.earliest_way import fewest_steps, has_walls
from solvers.engine.presolve import Subproblem
from solvers.pricing import PricedProfile

MANY_BODIES = 20
"""Encounters of a single mover among walls beyond which ways are looked for before branching: the
linear programs are large."""


def is_confined(subproblem: Subproblem) -> bool:
    """Return whether there is a single mover, among walls that it cannot jump over."""
    return subproblem.game.collisions == "swept" and _is_among_walls(subproblem)


def is_crowded(subproblem: Subproblem) -> bool:
    """Return whether there is a single mover among walls and many bodies."""
    return len(subproblem.encounters) > MANY_BODIES and _is_among_walls(subproblem)


def _is_among_walls(subproblem: Subproblem) -> bool:
    return len(subproblem.movers) == 1 and has_walls(subproblem.game, subproblem.movers[0])


def arrives_at(plans: PricedProfile | None, earliest: Mapping[int, int]) -> bool:
    """Return whether plans are known by which the movers arrive at their ``earliest`` times."""
    return plans is not None and all(plans.profile[i].arrival == t for i, t in earliest.items())


def counted_steps(
    subproblem: Subproblem, earliest: Mapping[int, int], incumbent: PricedProfile | None
) -> dict[int, int]:
    """Return bounds on the arrival of a single mover that count the steps of its ways.

    Bounds at which the incumbent arrives stay as they are.
    """
    if arrives_at(incumbent, earliest):
        return dict(earliest)
    return {i: max(t, fewest_steps(subproblem.game, i) or 0) for i, t in earliest.items()}
