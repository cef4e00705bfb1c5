r"""First plans of several agents at once: ways over points of space, then a linear program.

Branch and bound can be long without any plan where agents have to make room for each other.  Ways
(:mod:`solvers.engine.joint_ways`), improved one by one (:mod:`solvers.engine.way_improvement`),
show who passes where and when; with the faces along them, a linear program finds the controls.
Agents with inertia may need more time than their ways take.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.barriers import barriers
from ppg_env.game.free_space import FreeSpace
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.joint_ways import JointWays
from solvers.engine.node_lp import Relaxation
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.engine.way_grid import IN_SPACE, LIMIT, MOST_POINTS, WayGrid, lengths_from_rest
from solvers.engine.way_improvement import WayImprovement
from solvers.pricing import PricedProfile, price

ATTEMPTS = 120
"""Attempts to find ways, at most."""

ENOUGH = 4
"""Ways that are found and improved.  The best plans along them are returned."""

AGILITIES = (4, 2, 8)
"""Steps after which speeds from rest are allowed, in turn, for agents with inertia."""

PACES = (1.0, 1.25, 1.5, 2.0)
"""Times in which ways are followed, in those that they take, for agents with inertia."""

ENOUGH_TIME = 0.35
"""Part of the time after which the first of them suffice."""

MARGIN = 2.0
"""Room around starts, goals and bodies, in sizes of the largest body."""

MOST_DIMENSIONS = 3
"""Points fill spaces of more dimensions too thinly."""


def find_joint_plans(subproblem: Subproblem, budget: Budget) -> PricedProfile | None:
    """Return feasible plans of the movers along ways past each other, if some are found."""
    if subproblem.game.dim > MOST_DIMENSIONS:
        return None
    inert = any(
        not _moves_by_controls(subproblem.game.agents[i].B, subproblem.game.dim)
        for i in subproblem.movers
    )
    best: PricedProfile | None = None
    for agility in AGILITIES if inert else AGILITIES[:1]:
        for ways in _ways(subproblem, agility, inert, budget):
            for pace in PACES if inert else PACES[:1]:
                plans = _plans_along(subproblem, [_at_pace(way, pace) for way in ways], budget)
                if plans is not None:
                    best = plans if best is None or plans.value < best.value else best
                    break
            if best is not None and budget.time_used > ENOUGH_TIME:
                break
        if best is not None or budget.out:
            break
    return best


def _moves_by_controls(effect: np.ndarray, dim: int) -> bool:
    """Return whether controls move a body by themselves: its positions are its whole state."""
    return len(effect) == dim


def _ways(
    subproblem: Subproblem, agility: int, inert: bool, budget: Budget
) -> Iterator[list[np.ndarray]]:
    """Yield ways of all movers, improved ones first; ``inert`` movers may not follow those."""
    game = subproblem.game
    region, grids = _region(subproblem), []
    for i in subproblem.movers:
        bodies = barriers(game, i, subproblem.given)
        cells = FreeSpace(game, i, bodies).cells
        if cells is None:
            return
        low, high = cells.low, cells.low + np.array(cells.shape) * cells.size
        box = np.maximum(region[0], low), np.minimum(region[1], high)
        grids.append(
            WayGrid(
                game.agents[i],
                bodies,
                box,
                game.horizon,
                agility,
                swept=game.collisions == "swept",
                stays=game.on_goal == "stay",
                most=_most_points(subproblem),
            )
        )
        if budget.out or not np.isfinite(grids[-1].left[0, 0]):
            return
    if len(grids) == 1 and (shortest := grids[0].way_past([])) is not None:
        yield [shortest]
    search = JointWays(game, subproblem.movers, grids)
    costs = subproblem.objective.time[list(subproblem.movers)].tolist()
    improvement = WayImprovement(game, subproblem.movers, grids, costs, budget)
    made, found = set[bytes](), 0
    for attempt in range(ATTEMPTS):
        if budget.out or found >= ENOUGH:
            return
        ways = search.find(attempt)
        if ways is None:
            continue
        found += 1
        for better in chain(improvement.variants(ways), [ways] * inert):
            name = b"|".join(way.tobytes() for way in better)
            if name not in made:
                made.add(name)
                yield better


def _most_points(subproblem: Subproblem) -> int:
    """Return the number of points that regular lines may add up to, for each mover."""
    if subproblem.game.dim > 2:
        return IN_SPACE
    return MOST_POINTS if len(subproblem.movers) > 1 else LIMIT


def _region(subproblem: Subproblem) -> tuple[np.ndarray, np.ndarray]:
    """Return a box around starts and goals, with room to pass bodies of all kinds."""
    game, d = subproblem.game, subproblem.game.dim
    ends = np.array(
        [end[:d] for i in subproblem.movers for end in (game.agents[i].start, game.agents[i].goal)]
    )
    pairs = [e for e in game.encounters if e.obstacle is None]
    size = max((float(np.abs(e.collision.bounds).max()) for e in pairs), default=0.0)
    low, high = ends.min(axis=0), ends.max(axis=0)
    bodies = [
        e.collision.bounds
        for e in game.encounters
        if e.obstacle is not None and game.obstacles[e.obstacle].path is None
    ]
    while True:
        joined = [b for b in bodies if ((b[0] <= high) & (b[1] >= low)).all()]
        least = np.min([low, *(bounds[0] for bounds in joined)], axis=0)
        most = np.max([high, *(bounds[1] for bounds in joined)], axis=0)
        if np.array_equal(least, low) and np.array_equal(most, high):
            break
        low, high = least, most
    room = MARGIN * size + max(_longest_step(game.agents[i]) for i in subproblem.movers)
    return low - room, high + room


def _longest_step(agent: Agent) -> float:
    """Return the longest step along an axis of an agent that moves by its controls."""
    axes = np.vstack([np.eye(agent.dim), -np.eye(agent.dim)])
    return float(lengths_from_rest(agent, axes, 1).max())


def _at_pace(way: np.ndarray, pace: float) -> np.ndarray:
    """Return the same way (T+1, d) in ``pace`` times the time."""
    last = len(way) - 1
    times = np.linspace(0, last, int(np.ceil(pace * last)) + 1)
    return np.array([np.interp(times, np.arange(last + 1), column) for column in way.T]).T


def _plans_along(
    subproblem: Subproblem, ways: list[np.ndarray], budget: Budget
) -> PricedProfile | None:
    """Return plans with the faces along the ways of the movers, if there are any."""
    game = subproblem.game
    arrivals = {i: len(way) - 1 for i, way in zip(subproblem.movers, ways, strict=True)}
    if budget.out or max(arrivals.values()) > game.horizon:
        return None
    if len(ways) == 1 and (followed := _followed(subproblem, ways[0])) is not None:
        return followed
    presolved = presolve_encounters(subproblem, subproblem.encounters, arrivals)
    if presolved is None:
        return None
    means = [np.zeros((1, agent.state_dim)) for agent in game.agents]
    for i, way in zip(subproblem.movers, ways, strict=True):
        means[i] = np.zeros((len(way), game.agents[i].state_dim))
        means[i][:, : game.dim] = way
    program = FixedProgram(subproblem, arrivals, presolved)
    point = Relaxation(program, 0.0, budget).solve_near(means)
    if point is None:
        return None
    return price(subproblem.objective, program.controls_at(point), subproblem.given)


def _followed(subproblem: Subproblem, way: np.ndarray) -> PricedProfile | None:
    """Return the plans of the only mover on the way itself, if they lose nothing but time."""
    (mover,), game, end = subproblem.movers, subproblem.game, len(way) - 1
    agent = game.agents[mover]
    if agent.state_dim != game.dim:
        return None
    controls = np.zeros((game.horizon, agent.control_dim))
    pushes = (way[1:] - way[:-1] @ agent.A.T).T
    controls[:end] = np.linalg.lstsq(agent.B, pushes, rcond=None)[0].T
    priced = price(subproblem.objective, {mover: controls}, subproblem.given)
    least = float(subproblem.objective.time[mover]) * end
    return None if priced is None or priced.value > least + tol.IMPROVEMENT else priced
