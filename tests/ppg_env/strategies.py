"""Hypothesis strategies: polygons, covariances, games, and profiles that arrive somewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from ppg_env import Agent, Game, InputError, Polytope, Profile, make_profile
from ppg_env.game import collision_set
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.hulls import corners_of_points
from ppg_env.game.obstacle import Obstacle

LENGTHS = st.floats(0.5, 20.0)
NAMES = st.none() | st.text(min_size=1, max_size=8).filter(
    lambda text: text.strip() and text.isprintable()
)


def points(dim: int, size: int = 8) -> st.SearchStrategy[list[list[int]]]:
    """Grid points: ties, duplicates, collinear points and points inside the hull are common."""
    point = st.lists(st.integers(-size, size), min_size=dim, max_size=dim)
    return st.lists(point, min_size=dim + 1, max_size=dim + 6)


@st.composite
def hulls(draw: st.DrawFn, dim: int = 2, size: int = 8) -> Polytope:
    """Convex hulls of grid points, not flat."""
    try:
        corners = corners_of_points(np.array(draw(points(dim, size)), dtype=float))
        hull = Polytope.from_vertices(corners)
    except InputError:
        assume(False)
        raise
    assume(not hull.is_flat)
    return hull


@st.composite
def halfspaces(draw: st.DrawFn, dim: int = 2) -> Polytope:
    """A box cut by a few planes that leave the origin inside."""
    rows = np.concatenate([np.eye(dim), -np.eye(dim)])
    cuts = draw(st.lists(st.lists(st.integers(-3, 3), min_size=dim, max_size=dim), max_size=3))
    cuts = [cut for cut in cuts if any(cut)]
    rows = np.concatenate([rows, np.reshape(cuts, (-1, dim))])
    offsets = draw(st.lists(LENGTHS, min_size=len(rows), max_size=len(rows)))
    return Polytope.from_halfspaces(rows, offsets)


@st.composite
def boxes(draw: st.DrawFn, dim: int = 2) -> Polytope:
    return Polytope.box(draw(st.lists(LENGTHS, min_size=dim, max_size=dim)))


def bodies(dim: int = 2) -> st.SearchStrategy[Polytope]:
    """Shapes and obstacles as a game file can say them."""
    return boxes(dim) | hulls(dim) | halfspaces(dim)


def controls(dim: int = 2) -> st.SearchStrategy[Polytope]:
    """Control sets as a game file can say them."""
    l1 = st.builds(Polytope.l1, LENGTHS, st.just(dim))
    disc = st.builds(Polytope.disc, LENGTHS, st.integers(3, 20))
    return bodies(dim) | l1 | disc if dim == 2 else bodies(dim) | l1


@st.composite
def changing(draw: st.DrawFn, dim: int = 2) -> tuple[tuple[int, Polytope], ...]:
    """Control sets that change once or twice, within the steps of a short game or after it."""
    firsts = draw(st.lists(st.integers(1, 8), min_size=1, max_size=2, unique=True))
    return tuple((first, draw(controls(dim))) for first in [0, *sorted(firsts)])


@st.composite
def matrices(draw: st.DrawFn, rows: int, columns: int, limit: float = 1.0) -> np.ndarray:
    entries = st.floats(-limit, limit, allow_subnormal=False)
    flat = draw(st.lists(entries, min_size=rows * columns, max_size=rows * columns))
    return np.reshape(flat, (rows, columns))


@st.composite
def covariances(draw: st.DrawFn, dim: int) -> np.ndarray:
    """L L' + diagonal: positive definite, correlated."""
    root = draw(matrices(dim, dim, 2.0))
    return root @ root.T + draw(st.floats(0.1, 2.0)) * np.eye(dim)


def double_integrator(dim: int) -> tuple[np.ndarray, np.ndarray]:
    """A and B of position and velocity under acceleration."""
    one = np.eye(dim)
    return np.block([[one, one], [0 * one, one]]), np.concatenate([0.5 * one, one])


@st.composite
def agents(draw: st.DrawFn, dim: int, place: np.ndarray) -> Agent:
    """An agent of any shape near ``place``; integrators and double integrators."""
    double = draw(st.booleans())
    n, m = (2 * dim, dim) if double else (dim, dim)
    start = np.zeros(n)
    start[:dim] = place + draw(st.lists(st.floats(-5, 5), min_size=dim, max_size=dim))
    whole = draw(st.booleans())
    size = n if whole else dim
    goal = draw(st.lists(st.floats(-100, 100), min_size=size, max_size=size))
    A, B = double_integrator(dim) if double else (None, None)
    return Agent(
        start=start,
        goal=np.array(goal),
        shape=draw(bodies(dim)),
        control=draw(controls(dim) | changing(dim)),
        lam=draw(st.floats(0, 1 - 1e-7)),
        gain=draw(matrices(m, n)),
        noise=draw(covariances(n)),
        A=A,
        B=B,
        sigma0=draw(st.just(0.0) | covariances(n)),
        name=draw(NAMES),
    )


@st.composite
def bound(draw: st.DrawFn, agent: Agent) -> Agent:
    """The agent with a workspace, a reserve and a cost of effort, or without them."""
    return replace(
        agent,
        within=draw(regions(agent.dim, agent.state_dim)),
        reserve=draw(st.just(0.0) | st.floats(0, 0.1)),
        effort=draw(st.just(0.0) | st.floats(0, 9)),
    )


@st.composite
def regions(draw: st.DrawFn, dim: int, n: int) -> tuple[HalfSpaces, ...]:
    """Workspaces and speed limits around all places of :func:`games`, bounded or not."""
    listed = []
    for size in draw(st.lists(st.sampled_from([dim, n]), max_size=2)):
        low = draw(st.lists(st.floats(-2e3, -1e3) | st.just(-np.inf), min_size=size, max_size=size))
        high = [1e3, *draw(st.lists(st.floats(1e3, 2e3), min_size=size - 1, max_size=size - 1))]
        listed.append(HalfSpaces.between(low, high, draw(st.floats(0, 1))))
    return tuple(listed)


@st.composite
def obstacles(draw: st.DrawFn, dim: int) -> Obstacle:
    """Bodies far from all agents of :func:`games`, at rest or moving, for ever or for a while."""
    until = draw(st.none() | st.integers(1, 40))
    if draw(st.booleans()):
        return Obstacle(_far(draw(bodies(dim))), until=until)
    point = st.lists(st.floats(-300, -200), min_size=dim, max_size=dim)
    path = draw(st.lists(point, min_size=1, max_size=5))
    noise = draw(st.just(0.0) | covariances(dim))
    return Obstacle(draw(bodies(dim)), np.array(path), noise, until)


@st.composite
def games(draw: st.DrawFn) -> Game:
    """Games of one to three agents in one to three dimensions, anything a file can hold."""
    dim, count = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    places = [np.full(dim, 100.0 * k) for k in range(count)]
    movers = [draw(bound(draw(agents(dim, place)))) for place in places]
    assume(len({a.name for a in movers if a.name}) == sum(a.name is not None for a in movers))
    try:
        return Game(
            agents=tuple(movers),
            obstacles=tuple(draw(st.lists(obstacles(dim), max_size=2))),
            horizon=draw(st.integers(1, 30)),
            objective=draw(st.sampled_from(["margin", "risk"])),
            margin_cap=draw(st.none() | st.floats(0.1, 26)),
            crash_cost=draw(st.floats(0, 1e6)),
            scale=draw(st.sampled_from(["exact", "paper"])),
            collisions=draw(st.sampled_from(["instants", "swept"])),
            on_goal=draw(st.sampled_from(["remove", "stay"])),
            name=draw(NAMES),
        )
    except InputError as error:  # a name such as "agent_1" may be taken, a goal, all controls
        assume(not any(word in str(error) for word in ("twice", "parks", "leaves no control")))
        raise


def _far(body: Polytope) -> Polytope:
    return Polytope.from_vertices(body.vertices - 200.0)


@dataclass(frozen=True)
class Play:
    """A game and controls for it: ``controls[i]`` (H, m) bring agent i to its goal."""

    game: Game
    controls: tuple[np.ndarray, ...]

    @property
    def profile(self) -> Profile:
        return make_profile(self.game, self.controls)


@st.composite
def plays(draw: st.DrawFn, scale: str | None = None, missing: bool = False) -> Play:
    """Agents among obstacles, close enough for margins between the extremes.

    Controls come first and goals follow from them, so that all agents arrive, at different
    times; with ``missing`` some goals are moved out of reach (and time then counts: lam > 0).
    """
    count, horizon = draw(st.integers(1, 3)), draw(st.integers(1, 5))
    movers, plays = [], []
    for k in range(count):
        steps = draw(st.integers(0, horizon))
        moves = draw(st.lists(_MOVE, min_size=steps, max_size=steps))
        rows = np.zeros((horizon, 2))
        rows[:steps] = np.reshape(moves, (-1, 2))
        start = np.array([24.0 * k, 0.0])
        goal = start + rows.sum(axis=0)
        if missing and draw(st.booleans()):
            goal = goal + 1000.0
        movers.append(
            Agent(
                start=start,
                goal=goal,
                shape=draw(boxes().filter(lambda box: box.params[0].max() < 12) | hulls(size=5)),
                control=Polytope.box([16.0, 16.0]),
                lam=draw(st.floats(0.05 if missing else 0.0, 0.95)),
                gain=draw(matrices(2, 2, 0.8)),
                noise=draw(covariances(2)) * draw(st.sampled_from([0.1, 1.0, 10.0])),
                sigma0=draw(st.sampled_from([0.0, 0.5])),
            )
        )
        plays.append(rows)
    walls = [
        hull.vertices + np.array([12.0, 25.0]) for hull in draw(st.lists(hulls(size=6), max_size=2))
    ]
    walls = [wall for wall in walls if all(_is_clear(mover, wall) for mover in movers)]
    game = Game(
        agents=tuple(movers),
        obstacles=tuple(Obstacle(Polytope.from_vertices(wall)) for wall in walls),
        horizon=horizon,
        objective=draw(st.sampled_from(["margin", "risk"])),
        crash_cost=draw(st.floats(0, 1000)),
        scale=draw(st.sampled_from(["exact", "paper"])) if scale is None else scale,
    )
    return Play(game, tuple(plays))


def _is_clear(agent: Agent, wall: np.ndarray) -> bool:
    """Whether an agent may stop at its goal next to an obstacle."""
    collision = collision_set(agent.shape, Polytope.from_vertices(wall))
    return float(collision.clearance(agent.goal)) >= 0


_MOVE = st.tuples(st.integers(-8, 8), st.integers(-8, 8))
