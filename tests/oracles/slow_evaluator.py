"""The evaluator once more, in plain loops and straight from sections 2 and 6 of the design.

Shares no code with :mod:`ppg_env`: faces of K come from the edges of both bodies, covariances from
the recursion, arrivals from the means, traffic and events from their definitions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from itertools import combinations
from math import erfc, inf, sqrt

import numpy as np

from ppg_env import Agent, Game
from ppg_env.game.obstacle import Obstacle

Face = tuple[np.ndarray, float]


@dataclass
class Judgement:
    """Costs, and by how much constraints are violated: per agent, or per encounter."""

    arrival: list[int | None]
    safety_cost: list[float]
    deficit: list[float]
    risk: list[float]
    effort: list[float]
    cost: list[float]
    shifted_cost: list[float]
    potential: float
    control: list[float]
    within: list[float]
    overlap: list[float]


@dataclass
class Body:
    """Where a body is at times 0..H, how uncertain, and when it comes to rest."""

    shape: np.ndarray
    places: list[np.ndarray]
    spreads: list[np.ndarray]
    rest: float
    until: float = inf


@dataclass
class Tally:
    """What the events of all encounters add up to, agent by agent."""

    safety: list[float]
    deficit: list[float]
    risk: list[float]
    losses: list[float]
    potential: float = 0.0
    overlap: list[float] = field(default_factory=list)


def slow_evaluation(game: Game, controls: list[np.ndarray]) -> Judgement:
    count = len(game.agents)
    plans = [plan_of(agent, rows) for agent, rows in zip(game.agents, controls, strict=True)]
    bodies = [
        body_of(game, agent, states, arrival)
        for agent, (states, arrival) in zip(game.agents, plans, strict=True)
    ]
    tally = Tally(*([0.0] * count for _ in range(4)))
    for i in range(count):
        for j in range(i + 1, count):
            add_encounter(game, tally, [i, j], bodies[i], bodies[j])
    for i in range(count):
        for obstacle in game.obstacles:
            add_encounter(game, tally, [i], bodies[i], body_of_obstacle(game, obstacle))

    cost, shifted, effort, control, within = [], [], [], [], []
    for i, agent in enumerate(game.agents):
        states, arrival = plans[i]
        end = inf if arrival is None else arrival
        moving = [u for t, u in enumerate(controls[i]) if t < end]
        effort.append(float(sum(abs(x) for u in moving for x in u)))
        own = inf if arrival is None else agent.lam * arrival + agent.effort * effort[-1]
        shifted.append(own + (1 - agent.lam) * tally.losses[i])
        paper = tally.safety[i] if game.objective == "margin" else tally.losses[i]
        cost.append(own + (1 - agent.lam) * paper)
        tally.potential += own / (1 - agent.lam)
        control.append(control_excess(agent, moving))
        within.append(within_excess(agent, states[: len(moving) + 1]))
    return Judgement(
        [arrival for _, arrival in plans],
        tally.safety, tally.deficit, tally.risk, effort, cost, shifted, tally.potential,
        control, within, tally.overlap,
    )  # fmt: skip


def plan_of(agent: Agent, controls: np.ndarray) -> tuple[list[np.ndarray], int | None]:
    """The states at all times, those of the arrival from then on, and the arrival."""
    states, arrival = [np.array(agent.start)], None
    for t in range(len(controls) + 1):
        if arrival is None and np.abs(states[t][: len(agent.goal)] - agent.goal).max() <= 1e-6:
            arrival = t
        if t < len(controls):
            moves = agent.A @ states[t] + agent.B @ controls[t]
            states.append(moves if arrival is None else states[t])
    return states, arrival


def body_of(game: Game, agent: Agent, states: list[np.ndarray], arrival: int | None) -> Body:
    d, rest = game.dim, inf if arrival is None else arrival
    spreads = [matrix[:d, :d] for matrix in spread_over_time(agent, game.horizon)]
    if game.on_goal == "stay":
        spreads = [spreads[t] if t < rest else spreads[int(rest)] for t in range(len(spreads))]
    return Body(agent.shape.vertices, [x[:d] for x in states], spreads, rest)


def body_of_obstacle(game: Game, obstacle: Obstacle) -> Body:
    path = np.zeros((1, game.dim)) if obstacle.path is None else obstacle.path
    last = len(path) - 1
    times = [min(t, last) for t in range(game.horizon + 1)]
    until = inf if obstacle.until is None else obstacle.until
    spreads = [t * obstacle.noise for t in times]
    return Body(obstacle.shape.vertices, [path[t] for t in times], spreads, last, until)


def add_encounter(game: Game, tally: Tally, parties: list[int], one: Body, other: Body) -> None:
    """Count all events of an encounter: instants, or the steps between them."""
    faces = faces_of_sum(other.shape, -one.shape)
    deepest = 0.0
    rests = [one.rest, other.rest] if len(parties) == 2 or game.on_goal == "stay" else [one.rest]
    end = min(max(rests) if game.on_goal == "stay" else min(rests), other.until)
    swept = game.collisions == "swept"
    for t in range(game.horizon + 1):
        margin, danger, loss = game.margin_cap, 0.0, 0.0
        if t < end and not (swept and t == game.horizon):
            ends = [t, t + 1] if swept else [t]
            apart = [one.places[k] - other.places[k] for k in ends]
            margin = margin_of(
                game, faces, apart, [one.spreads[k] + other.spreads[k] for k in ends]
            )
            clear = max(min(normal @ place - offset for place in apart) for normal, offset in faces)
            deepest = max(deepest, -clear)
            danger = len(ends) * erfc(margin) / 2
            loss = game.margin_cap - margin
            loss = loss if game.objective == "margin" else game.crash_cost * danger
        tally.potential += loss
        for i in parties:
            tally.safety[i] -= margin
            tally.deficit[i] += game.margin_cap - margin
            tally.risk[i] += danger
            tally.losses[i] += loss
    tally.overlap.append(deepest)


def control_excess(agent: Agent, controls: list[np.ndarray]) -> float:
    """By how much a control comes nearer to a face of its set than feedback may need."""
    worst, spreads = 0.0, spread_over_time(agent, len(controls))
    for t, u in enumerate(controls):
        asked = agent.gain @ spreads[t] @ agent.gain.T
        faces = list(zip(*agent.control_at(t).faces, strict=True))
        room = [agent.reserve * sqrt(max(n @ asked @ n, 0.0)) for n, _ in faces]
        if any(room):
            cut = [(n, b - less) for (n, b), less in zip(faces, room, strict=True)]
            faces = faces_that_remain(cut)
        for normal, offset in faces:
            worst = max(worst, float(normal @ u - offset))
    return worst


def faces_that_remain(faces: list[Face]) -> list[Face]:
    """Faces of the set between planes that were moved inwards, some of which it no longer touches.

    A face has d corners, among the points where d planes meet, that are not in fewer dimensions.
    """
    d = len(faces[0][0])
    size = max(abs(offset) for _, offset in faces)
    corners = []
    for planes in combinations(faces, d):
        rows = np.array([normal for normal, _ in planes])
        if abs(np.linalg.det(rows)) > 1e-9:
            corner = np.linalg.solve(rows, [offset for _, offset in planes])
            if all(normal @ corner <= offset + 1e-9 * size for normal, offset in faces):
                corners.append(corner)
    remaining = []
    for normal, offset in faces:
        on = [c for c in corners if normal @ c >= offset - 1e-9 * size]
        if on and np.linalg.matrix_rank(np.array(on) - on[0], tol=1e-6 * size) == d - 1:
            remaining.append((normal, offset))
    return remaining


def within_excess(agent: Agent, states: list[np.ndarray]) -> float:
    """By how much a mean is beyond a face of its workspace, or too near; all as lengths."""
    worst, spreads, units = 0.0, spread_over_time(agent, len(states)), units_of_state(agent)
    for region in agent.within:
        for normal, offset in zip(region.normals, region.offsets, strict=True):
            k = len(normal)
            length = sqrt(sum((normal * units[:k]) ** 2)) / units[0]
            for x, spread in zip(states, spreads, strict=False):
                sigma = sqrt(max(normal @ spread[:k, :k] @ normal, 0.0))
                beyond = float(normal @ x[:k] + region.sigmas * sigma - offset)
                worst = max(worst, beyond / length)
    return worst


def units_of_state(agent: Agent) -> np.ndarray:
    """The size of the body for positions; for other components, what moves one by so much."""
    corners, n = agent.shape.vertices, agent.state_dim
    units = np.full(n, inf)
    units[: agent.dim] = max(np.ptp(corners, axis=0))
    for _ in range(n):
        for k in range(agent.dim, n):
            for j in range(n):
                if j != k and agent.A[j, k] != 0:
                    units[k] = min(units[k], units[j] / abs(agent.A[j, k]))
    return units


def spread_over_time(agent: Agent, horizon: int) -> list[np.ndarray]:
    spread = [np.array(agent.sigma0)]
    loop = agent.A - agent.B @ agent.gain
    for _ in range(horizon):
        spread.append(loop @ spread[-1] @ loop.T + agent.noise)
    return spread


def faces_of_sum(one: np.ndarray, other: np.ndarray) -> list[Face]:
    """Faces of the Minkowski sum of two convex bodies on a line, in the plane or in space."""
    return _faces_of_sum(tuple(map(tuple, one.tolist())), tuple(map(tuple, other.tolist())))


@cache
def _faces_of_sum(*corners: tuple[tuple[float, ...], ...]) -> list[Face]:
    """Faces of the sum of two bodies, kept because many encounters have the same two.

    A face is normal to d - 1 differences of corners, and the corners that are farthest along its
    normal, of both bodies, differ in d - 1 independent directions.
    """
    one, other = map(np.array, corners)
    d = one.shape[1]
    edges = [b - a for body in (one, other) for a in body for b in body if (a != b).any()]
    if d == 1:
        normals = edges
    elif d == 2:
        normals = [np.array([edge[1], -edge[0]]) for edge in edges]
    else:
        normals = [np.cross(a, b) for a in edges for b in edges]
    faces: dict[tuple[float, ...], Face] = {}
    for normal in normals:
        length = sqrt(normal @ normal)
        if length < 1e-9:
            continue
        unit, reach, along = normal / length, 0.0, [np.zeros(d)]
        for body in (one, other):
            far = max(unit @ c for c in body)
            reach += float(far)
            touching = [c for c in body if unit @ c >= far - 1e-9]
            along += [c - touching[0] for c in touching]
        if np.linalg.matrix_rank(np.array(along), tol=1e-9) == d - 1:
            faces[tuple(unit.round(9) + 0.0)] = (unit, reach)
    return list(faces.values())


def margin_of(
    game: Game, faces: list[Face], apart: list[np.ndarray], spreads: list[np.ndarray]
) -> float:
    """Margin of the face that is best at its worse end; one end is an instant."""
    best = -inf
    for normal, offset in faces:
        worse = inf
        for place, spread in zip(apart, spreads, strict=True):
            clearance = normal @ place - offset
            sigma = sqrt(max(normal @ spread @ normal, 0.0))
            unit = sigma * sqrt(2) if game.scale == "exact" else sigma
            if unit > 1e-12:
                worse = min(worse, clearance / unit)
            elif clearance < -1e-6:
                worse = -inf
        best = max(best, worse)
    return min(game.margin_cap, best)
