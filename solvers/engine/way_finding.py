r"""First plans of a single agent among walls: ways through the cells of its free space.

Branch and bound finds a way through a maze only after many linear programs.  Cells
(:mod:`ppg_env.game.free_space`) show it at once: from the goal at a possible arrival, back through
cells that were reached one step before, as far from bodies as they can be.  The faces along this
way make a linear program, whose plans are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.game.barriers import Barrier, barriers
from ppg_env.game.free_space import TICKS, FreeSpace
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.pricing import PricedProfile, price

TRIALS = (0, 1, 2, 3, 5, 8, 12)
"""Arrivals at which a way is looked for, counted from the earliest possible one."""

HASTE = 0.9
"""A way is not followed in less than this part of the time that its cells take."""

FINENESS = (1, 4)
"""Numbers of times as many cells, in turn until a plan takes no longer than the bound."""

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


def find_first_plans(subproblem: Subproblem, least: int, budget: Budget) -> FirstPlans:
    """Return a bound on the arrival of the only mover, and plans along a way through its cells.

    ``least`` is a bound that is known already.
    """
    (mover,) = subproblem.movers
    bodies = barriers(subproblem.game, mover, subproblem.given)
    space = FreeSpace(subproblem.game, mover, bodies)
    possible = [t for t in space.arrivals(lambda: budget.out) if t >= least]
    arrivals = [possible[k] for k in TRIALS if k < len(possible)]
    if not arrivals:
        return FirstPlans(least if budget.out else None, None)
    best: PricedProfile | None = None
    for finer in FINENESS:
        sure = FreeSpace(subproblem.game, mover, bodies, inner=True, finer=finer)
        last = next(sure.arrivals(lambda: budget.out), None)
        way = None if last is None else _way(sure, last)
        for arrival in arrivals:
            if best is not None and arrival >= (best.profile[mover].arrival or 0):
                break
            ways = [_way(space, arrival)] if finer == 1 else []
            if way is not None and arrival * TICKS >= HASTE * (len(way) - 1):
                ways.append(_in_time(way, arrival))
            for each in ways:
                plans = (
                    None if each is None or budget.out else _plans_along(subproblem, each, budget)
                )
                if plans is not None and (best is None or plans.value < best.value):
                    best = plans
        if best is None or best.profile[mover].arrival == arrivals[0]:
            break
    return FirstPlans(arrivals[0], best)


def _in_time(way: np.ndarray, arrival: int) -> np.ndarray:
    """Return the same way (T+1, d) at the speed at which it takes ``arrival`` steps."""
    times = np.linspace(0, len(way) - 1, arrival + 1)
    columns = [np.interp(times, np.arange(len(way)), column) for column in way.T]
    return np.array(columns).T


def _plans_along(subproblem: Subproblem, way: np.ndarray, budget: Budget) -> PricedProfile | None:
    """Return plans with the faces along a ``way`` (T+1, d) of the only mover, if there are any."""
    (mover,), game, arrivals = subproblem.movers, subproblem.game, len(way) - 1
    presolved = presolve_encounters(subproblem, subproblem.encounters, {mover: arrivals})
    if presolved is None:
        return None
    means = np.zeros((len(way), game.agents[mover].state_dim))
    means[:, : game.dim] = way
    program = FixedProgram(subproblem, {mover: arrivals}, presolved)
    point = Relaxation(program, 0.0, budget).solve_near([means] * len(game.agents))
    if point is None:
        return None
    return price(subproblem.objective, program.controls_at(point), subproblem.given)


def _way(space: FreeSpace, arrival: int) -> np.ndarray | None:
    """Return positions (T+1, d) of a way to the goal, from cell to cell; None if it breaks off."""
    cells = space.cells
    assert cells is not None
    way = np.empty((arrival + 1, len(space.goal)))
    way[0], way[arrival] = space.start, space.goal
    for t in range(arrival - 1, 0, -1):
        corner = np.floor((way[t + 1] - cells.low) / cells.size).astype(int)
        kernel = space.step_kernel(cells, t)
        before = corner - (np.argwhere(kernel) - np.array(kernel.shape) // 2)
        before = before[((before >= 0) & (before < cells.shape)).all(axis=1)]
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
