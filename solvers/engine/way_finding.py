r"""First plans of a single agent among walls: ways through the cells of its free space.

Branch and bound finds a way through a maze only after many linear programs.  Cells
(:mod:`ppg_env.game.free_space`) show it at once: from the goal at a possible arrival, back through
cells that were reached one step before, as far from bodies as they can be.  The faces along this
way make a linear program, whose plans are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np

from ppg_env.game.barriers import Barrier, barriers
from ppg_env.game.cells import Cells
from ppg_env.game.free_space import FreeSpace
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.pricing import PricedProfile, price

TRIALS = 4
"""Number of arrivals at which a way is looked for."""

CLEAR = 1.5
"""Clearance in sizes of a cell beyond which more is no better."""


@dataclass(frozen=True)
class FirstPlans:
    """What free space shows about a single mover among the plans of the others.

    Attributes
    ----------
    earliest : lower bound on its arrival; None if it cannot arrive within the horizon.
    plans : feasible plans, if some were found.
    """

    earliest: int | None
    plans: PricedProfile | None


def find_first_plans(subproblem: Subproblem, budget: Budget) -> FirstPlans:
    """Return a bound on the arrival of the only mover, and plans along a way through its cells."""
    (mover,) = subproblem.movers
    bodies = barriers(subproblem.game, mover, subproblem.given)
    space = FreeSpace(subproblem.game, mover, bodies)
    earliest, plans = None, None
    for arrival in islice(space.arrivals(), TRIALS):
        earliest = arrival if earliest is None else earliest
        plans = _plans_along(subproblem, space, arrival, budget)
        if plans is not None or budget.out:
            break
    return FirstPlans(earliest, plans)


def _plans_along(
    subproblem: Subproblem, space: FreeSpace, arrival: int, budget: Budget
) -> PricedProfile | None:
    """Return plans with the faces along a way that takes ``arrival`` steps, if there are any."""
    (mover,) = subproblem.movers
    presolved = presolve_encounters(subproblem, subproblem.encounters, {mover: arrival})
    if presolved is None or space.cells is None:
        return None
    game, way = subproblem.game, _way(space, space.cells, arrival)
    if way is None:
        return None
    means = np.zeros((arrival + 1, game.agents[mover].state_dim))
    means[:, : game.dim] = way
    program = FixedProgram(subproblem, {mover: arrival}, presolved)
    point = Relaxation(program, 0.0, budget).solve_near([means] * len(game.agents))
    if point is None:
        return None
    return price(subproblem.objective, program.controls_at(point), subproblem.given)


def _way(space: FreeSpace, cells: Cells, arrival: int) -> np.ndarray | None:
    """Return positions (T+1, d) of a way to the goal, from cell to cell; None if it breaks off."""
    way = np.empty((arrival + 1, len(space.goal)))
    way[0], way[arrival] = space.start, space.goal
    for t in range(arrival - 1, 0, -1):
        corner = np.floor((way[t + 1] - cells.low) / cells.size).astype(int)
        moves = np.argwhere(space.kernel(cells, t)) - np.array(space.kernel(cells, t).shape) // 2
        before = corner - moves
        inside = ((before >= 0) & (before < cells.shape)).all(axis=1)
        before = before[inside]
        before = before[space.reached[t][tuple(before.T)]]
        if not len(before):
            return None
        places = cells.centres(before)
        clear = _clearances(space.bodies, places, way[t + 1], t)
        clear = np.minimum(clear, CLEAR * float(cells.size.max()))
        # Among the clearest, prefer cells that were reached long ago, then short steps.
        age = _first_reached(space, before, t)
        length = np.abs(places - way[t + 1]).sum(axis=1)
        way[t] = places[np.lexsort((length, age, -np.round(clear / cells.size.max(), 1)))[0]]
    return way


def _clearances(bodies: list[Barrier], places: np.ndarray, after: np.ndarray, t: int) -> np.ndarray:
    """Return the least clearance (K,) from all bodies on the steps from ``places`` to ``after``."""
    result = np.full(len(places), np.inf)
    for body in bodies:
        if t >= body.until:
            continue
        normals, offsets = body.collision.faces
        before = (places - body.path[t]) @ normals.T - offsets
        end = normals @ (after - body.path[t + 1]) - offsets
        result = np.minimum(result, np.minimum(before, end).max(axis=1))
    return result


def _first_reached(space: FreeSpace, cells: np.ndarray, t: int) -> np.ndarray:
    """Return the first time (K,) up to t at which each of ``cells`` was reached."""
    masks = np.array([mask[tuple(cells.T)] for mask in space.reached[: t + 1]])
    return np.asarray(masks.argmax(axis=0))
