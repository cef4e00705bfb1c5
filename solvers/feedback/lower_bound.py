r"""Proved lower bounds on the expected cost of any players in the environment.

The cost of an agent is lam per step in traffic, its effort, and (1 - lam) kappa at a crash.
Whatever the others do, and whatever the agent sees, it is at least the least cost of the agent
alone who may, in addition, leave after any step at the cost of a crash: a crash does nothing else
to it, and an agent that is not removed pays for crashes and goes on.  Hence, for any players,

    cost_i >= solo_i,     sum_i cost_i >= sum_i solo_i,     regret_i <= cost_i - solo_i.

What the agents lose to each other is not in these bounds: they are close where agents pass at
ease, and loose where they meet.

``solo_i`` is bounded from below on a grid (:mod:`solvers.feedback.solo_grid`) of one or two state
components.  Larger states are relaxed: any components whose motion does not depend on the others
are a problem of their own, and the best bound of all of these counts.  Without noise the number of
steps follows from linear programs.  Obstacles are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.rules import Rules
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.polytope import Polytope
from solvers.feedback.gaussian_axis import Axis, NoAxis
from solvers.feedback.solo_grid import FAR, SoloGrid, SoloProblem

NODES_PER_DEVIATION = 4.0
"""Nodes of the grid per standard deviation of one step's noise."""

MOST_NODES = 1_000_000
"""Largest number of nodes; beyond it the grid is coarser, and the bound lower."""


def solo_lower_bound(game: Game, agent: int, rules: Rules | None = None) -> float:
    """Return a proved lower bound on the expected cost of ``agent``, whatever all players do.

    It also bounds the cost of the agent's best response to any players.
    """
    rules = (Rules() if rules is None else rules).of(game)
    mover, steps = game.agents[agent], rules.steps(game)
    crash = (1 - mover.lam) * game.crash_cost
    leave = crash if rules.on_crash == "remove" else float("inf")
    if mover.lam == 0:
        return 0.0
    if rules.schedule is not None:
        due = min(rules.schedule[agent], steps)
        return min(mover.lam * due, mover.lam + leave) if due > 0 else 0.0
    if _at_goal(mover, mover.start, rules.tolerance) and not mover.sigma0.any():
        return 0.0
    certain = 0.0 if mover.sigma0.any() else mover.lam
    if rules.saturation == "none":
        return certain
    if not (mover.noise.any() or mover.sigma0.any()):
        return _without_noise(mover, steps, rules.tolerance, leave)
    unit = leave / mover.lam
    if mover.effort == 0:
        unit = min(unit, float(steps))
    return max(
        certain,
        *(
            mover.lam
            * _block_bound(mover, block, unit, mover.effort / mover.lam, steps, rules.tolerance)
            for block in _blocks(mover)
        ),
        0.0,
    )


def social_lower_bound(game: Game, rules: Rules | None = None) -> float:
    """Return a proved lower bound on the expected sum of all agents' costs, for any players."""
    return sum(solo_lower_bound(game, i, rules) for i in range(len(game.agents)))


def _at_goal(agent: Agent, state: np.ndarray, tolerance: float) -> bool:
    size = agent.goal.size
    return bool((np.abs(state[:size] - agent.goal) <= tolerance).all())


def _blocks(agent: Agent) -> Iterator[tuple[int, ...]]:
    """Yield components, one or two, whose motion does not depend on the others."""
    n = agent.state_dim
    for size in (1, 2) if n != 2 else (2, 1):
        for block in combinations(range(n), size):
            chosen, rest = list(block), [k for k in range(n) if k not in block]
            free = not agent.A[np.ix_(chosen, rest)].any()
            noise, start = (M[np.ix_(chosen, chosen)] for M in (agent.noise, agent.sigma0))
            plain = not (noise - np.diag(np.diag(noise))).any()
            plain = plain and not (start - np.diag(np.diag(start))).any()
            noisy = bool((np.diag(noise) > tol.DEVIATION**2).all())
            if free and plain and noisy and block[0] < agent.goal.size:
                yield block
                if size == n:
                    return


def _without_noise(agent: Agent, steps: int, tolerance: float, leave: float) -> float:
    """Return the least cost of time and effort without noise, by linear programs."""
    first = agent.lam + leave
    best = min(first, agent.lam * steps)
    for count in range(1, steps + 1):
        if agent.lam * count >= best:
            break
        effort = _least_effort(agent, count, tolerance + tol.LENGTH * agent.unit)
        if effort is not None:
            best = min(best, agent.lam * count + agent.effort * effort)
            if agent.effort == 0:
                break
    return best


def _least_effort(agent: Agent, count: int, tolerance: float) -> float | None:
    """Return the least sum of |u|_1 over ``count`` steps into the region; None if there is none."""
    from scipy.optimize import linprog

    n, m, g = agent.state_dim, agent.control_dim, agent.goal.size
    power, effects = np.eye(n), []
    for _ in range(count):
        effects.insert(0, (power @ agent.B)[:g])
        power = power @ agent.A
    reach, drift = np.hstack(effects), (power @ agent.start)[:g] - agent.goal
    rows, limits = [reach, -reach], [tolerance - drift, tolerance + drift]
    faces = np.zeros((0, count * m))
    for t in range(count):
        control = agent.control_at(t)
        block = np.zeros((len(control.offsets), count * m))
        block[:, t * m : (t + 1) * m] = control.normals
        faces = np.vstack([faces, block])
        limits.append(control.offsets)
    rows.append(faces)
    size = count * m
    sizes = [np.hstack([sign * np.eye(size), -np.eye(size)]) for sign in (1.0, -1.0)]
    bounds = np.vstack([*(np.hstack([row, np.zeros((len(row), size))]) for row in rows), *sizes])
    limits += [np.zeros(2 * size)]
    cost = np.concatenate([np.zeros(size), np.ones(size)])
    solution = linprog(cost, bounds, np.concatenate(limits), bounds=(None, None))
    return None if solution.status == 2 else float(solution.fun or 0.0)


def _block_bound(
    agent: Agent,
    block: tuple[int, ...],
    leave: float,
    effort: float,
    steps: int,
    tolerance: float,
) -> float:
    """Return the bound of some components, in units of the cost of a step."""
    chosen = list(block)
    controls = [(first, control) for first, control in pieces(agent.control) if first < steps]
    moves = tuple((first, _image(agent.B[chosen], control)) for first, control in controls)
    A = np.zeros((2, 2))
    A[: len(block), : len(block)] = agent.A[np.ix_(chosen, chosen)]
    return _grid_bound(
        tuple(map(tuple, A)),
        tuple((first, tuple(map(tuple, corners))) for first, corners in moves),
        tuple(map(tuple, _slopes(agent.B[chosen], effort))),
        tuple(agent.start[chosen]),
        tuple(np.sqrt(np.diag(agent.sigma0)[chosen])),
        tuple(agent.goal[k] if k < agent.goal.size else None for k in block),
        tuple(np.sqrt(np.diag(agent.noise)[chosen])),
        tolerance,
        leave,
        steps,
    )


@lru_cache(maxsize=256)
def _grid_bound(
    A: tuple[tuple[float, ...], ...],
    moves: tuple[tuple[int, tuple[tuple[float, ...], ...]], ...],
    slopes: tuple[tuple[float, ...], ...],
    start: tuple[float, ...],
    deviation: tuple[float, ...],
    goal: tuple[float | None, ...],
    sigma: tuple[float, ...],
    tolerance: float,
    leave: float,
    steps: int,
) -> float:
    """Return the bound in units of the cost of a step; games that differ in lam alone share it."""
    sets = tuple((first, np.array(corners)) for first, corners in moves)
    axes = _axes(np.array(A), sets, start, deviation, goal, sigma, tolerance, steps)
    problem = SoloProblem(np.array(A), sets, np.array(slopes), axes, leave, steps)
    size = [*start, 0.0][:2], [*deviation, 0.0][:2]
    return SoloGrid(problem).value(*map(np.array, size))


def _axes(
    A: np.ndarray,
    sets: Sequence[tuple[int, np.ndarray]],
    start: Sequence[float],
    deviation: Sequence[float],
    goal: Sequence[float | None],
    sigma: Sequence[float],
    tolerance: float,
    steps: int,
) -> tuple[Axis, Axis | NoAxis]:
    """Return a grid on which it does not pay to walk to the rim: half of the way plus a rim."""
    corners = np.vstack([points for _, points in sets])
    travel = _travel(A, corners, start, goal, steps)
    spans = []
    for a, centre in enumerate(start):
        ends = [centre, centre if goal[a] is None else goal[a]]
        rim = FAR * sigma[a] + float(np.abs(corners[:, a]).max()) + FAR * deviation[a]
        spans.append((min(ends) - travel[a] - rim, max(ends) + travel[a] + rim))
    spacing = [s / NODES_PER_DEVIATION for s in sigma]
    count = float(
        np.prod([(high - low) / h for (low, high), h in zip(spans, spacing, strict=True)])
    )
    coarser = max(1.0, (count / MOST_NODES) ** (1 / len(spans)))
    axes = [
        _axis(span, goal[a], tolerance, coarser * spacing[a], sigma[a])
        for a, span in enumerate(spans)
    ]
    return axes[0], axes[1] if len(axes) > 1 else NoAxis()


def _axis(
    span: tuple[float, float], goal: float | None, tolerance: float, spacing: float, sigma: float
) -> Axis:
    """Return nodes that cover ``span``, with the sides of the arrival region among them."""
    low, high = span
    if goal is None:
        return Axis(low, spacing, int(np.ceil((high - low) / spacing)) + 1, sigma, None)
    inside = int(np.ceil(2 * tolerance / spacing))
    if inside:
        spacing = 2 * tolerance / inside
    before = int(np.ceil((goal - tolerance - low) / spacing))
    after = int(np.ceil((high - goal - tolerance) / spacing))
    count = before + inside + after + 1
    return Axis(
        goal - tolerance - before * spacing, spacing, count, sigma, (before, before + inside)
    )


def _travel(
    A: np.ndarray,
    corners: np.ndarray,
    start: Sequence[float],
    goal: Sequence[float | None],
    steps: int,
) -> np.ndarray:
    """Return (2,) how far the inputs may carry the state in half the steps of the way."""
    free = np.array([*start, 0.0][:2])
    far, power, reach = np.zeros(2), np.eye(2), []
    wanted = np.array([0.0 if g is None else g for g in [*goal, None][:2]])
    fixed = np.array([g is not None for g in [*goal, None][:2]])
    for _ in range(steps):
        far = far + np.abs(corners @ power.T).max(axis=0)
        reach.append(far)
        free, power = A @ free, power @ A
        images = (np.abs(wanted - free) / np.maximum(far, 1e-300))[fixed]
        if images.sum() <= 1.5:  # for sets that are not boxes the way is longer
            break
    return reach[min(len(reach) // 2 + 1, len(reach) - 1)]


def _image(B: np.ndarray, control: Polytope) -> np.ndarray:
    """Return the corners (V, 2) of B U, counter-clockwise; on a line, the second component is 0."""
    points = np.unique(control.vertices @ B.T, axis=0)
    if points.shape[1] == 1:
        return np.array([[points.min(), 0.0], [points.max(), 0.0]])
    return points if len(points) < 3 else Polytope("vertices", (points,)).vertices


def _slopes(B: np.ndarray, effort: float) -> np.ndarray:
    """Return (K, 2) tangents q of the effort, |B' q| <= effort, zero among them."""
    slopes = [np.zeros(2)]
    if effort > 0:
        angles = np.arange(16) * np.pi / 8
        directions = np.column_stack([np.cos(angles), np.sin(angles)])[:, : len(B)]
        for direction in directions[:: 1 if len(B) == 2 else 8]:
            size = float(np.abs(direction @ B).max())
            if size > 0:
                slopes.append(np.array([*(direction * effort / size), 0.0][:2]))
    return np.array(slopes)
