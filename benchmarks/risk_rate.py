"""Speed of the methods that find crash probabilities, on one core, each beside its limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from time import perf_counter

import numpy as np

from benchmarks.measurement import Measurement
from benchmarks.rates import on_one_core
from ppg_env.game import Agent, Game
from ppg_env.plan import Profile, straight_plan
from ppg_env.polytope import Polytope
from ppg_env.risk.bounds import risk_bounds

REPEATS = 7


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """``exact`` for whole plans, in the plane and in space."""
    with on_one_core():
        yield from _exact(1 if quick else REPEATS)


def _exact(repeats: int) -> Iterator[Measurement]:
    """Two agents side by side for 15 steps: of boxes, of polygons, of octahedra."""
    square, cube = Polytope.box([15.0] * 2), Polytope.box([15.0] * 3)
    shapes = {"boxes": square, "hexagons": Polytope.disc(7.5, 6)}
    shapes |= {"boxes in space": cube, "octahedra in space": Polytope.l1(7.5, 3)}
    for name, shape in shapes.items():
        game = side_by_side(shape)
        seconds = best(partial(risk_bounds, game, straight(game)), repeats)
        yield Measurement(f"exact, a plan of two agents, {name}: ms", 1e3 * seconds, 20)


def side_by_side(shape: Polytope) -> Game:
    """Two agents, 20 apart, in traffic for all 15 steps."""
    start = np.zeros((2, shape.dim))
    start[1, 1] = 20.0
    ahead = 150.0 * np.eye(shape.dim)[0]
    speed = Polytope.box([20.0] * shape.dim)
    gain = 0.5 * np.eye(shape.dim)
    return Game(tuple(Agent(r, r + ahead, shape, speed, gain=gain) for r in start))


def straight(game: Game) -> Profile:
    """Everybody's straight plan."""
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return tuple(plan for plan in plans if plan is not None)


def best(work: Callable[[], object], repeats: int) -> float:
    """Least seconds of ``work`` over ``repeats`` runs, after one that fills the caches."""
    work()
    spent = []
    for _ in range(repeats):
        begun = perf_counter()
        work()
        spent.append(perf_counter() - begun)
    return min(spent)
