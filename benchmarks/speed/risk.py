"""Speed of the methods for crash probabilities, on one core, with their targets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from time import perf_counter

import numpy as np

from baselines.evaluate_runs import OF_A_LEVEL, evaluate_rare_runs
from benchmarks.speed.environment import on_one_core
from benchmarks.speed.measurement import Measurement
from ppg_env.env.players import track
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.plan import Profile
from ppg_env.game.polytope import Polytope
from ppg_env.risk.batches import BLOCK
from ppg_env.risk.importance_sampling import IN_SIGHT, rare_risk
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.risk.union_bounds import risk_bounds
from ppg_env.support.statistics import RareRisk

REPEATS = 7

RARE = {"1e-6": 0.338, "1e-9": 0.229}
"""Noise variance at which two agents side by side crash with that probability."""


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure ``exact`` for whole plans, ``mc`` relative to drawing its normals, and ``rare``."""
    repeats = 1 if quick else REPEATS
    with on_one_core():
        yield from _exact(repeats)
        yield from _counting(20_000 if quick else 200_000, 3 * repeats, seed)
        yield from _rare(5_000 if quick else IN_SIGHT, repeats, seed)
        yield from _splitting(2_000 if quick else OF_A_LEVEL, seed)


def _exact(repeats: int) -> Iterator[Measurement]:
    """Measure two agents side by side for 15 steps: boxes, polygons, octahedra."""
    square, cube = Polytope.box([15.0] * 2), Polytope.box([15.0] * 3)
    shapes = {"boxes": square, "hexagons": Polytope.disc(7.5, 6)}
    shapes |= {"boxes in space": cube, "octahedra in space": Polytope.l1(7.5, 3)}
    for name, shape in shapes.items():
        game = side_by_side(shape)
        seconds = best(partial(risk_bounds, game, straight(game)), repeats)
        yield Measurement(f"exact, a plan of two agents, {name}: ms", 1e3 * seconds, 20)


def _counting(episodes: int, repeats: int, seed: int) -> Iterator[Measurement]:
    """Measure two agents in traffic for 15 steps in the plane: 60 normals per episode."""
    game = side_by_side(Polytope.box([15.0] * 2))
    profile, random = straight(game), np.random.default_rng(seed)
    normals = np.empty(60 * BLOCK)
    drawing = BLOCK / best(lambda: random.standard_normal(out=normals), 20 * repeats)
    for name, swept, target in (("", False, 0.5), (", swept", True, 0.0)):
        work = partial(crash_counts, game, profile, episodes, seed, swept=swept)
        rate = episodes / best(work, repeats)
        yield Measurement(f"mc{name}: million episodes per second", rate / 1e6, 0, True)
        what = f"mc{name}: times the rate of drawing their normals"
        yield Measurement(what, rate / drawing, target, True)


def _rare(episodes: int, repeats: int, seed: int) -> Iterator[Measurement]:
    """Measure two agents side by side: standard error and seconds."""
    for size, noise in RARE.items():
        game = side_by_side(Polytope.box([15.0] * 2), noise)
        profile = straight(game)
        seconds = best(partial(rare_risk, game, profile, episodes, seed), repeats)
        error = _error(rare_risk(game, profile, episodes, seed))
        yield Measurement(f"rare at {size}, {episodes:,} episodes: std. error, %", error, 5)
        yield Measurement(f"rare at {size}, {episodes:,} episodes: s", seconds, 2)


def _splitting(episodes: int, seed: int) -> Iterator[Measurement]:
    """Measure the same plans, tracked in the environment."""
    for size, noise in RARE.items():
        game = side_by_side(Polytope.box([15.0] * 2), noise)
        players = [track(game, straight(game))]
        started = perf_counter()
        risk = evaluate_rare_runs(game, players, episodes, seed)
        seconds, what = perf_counter() - started, f"splitting at {size}, {risk.samples:,} episodes"
        yield Measurement(f"{what}: std. error, %", _error(risk), 0, True)
        yield Measurement(f"{what}: s", seconds, 0, True)


def _error(risk: RareRisk) -> float:
    """Return the relative standard error in percent."""
    return 100 * risk.any.standard_error / max(risk.any.value, 1e-300)


def side_by_side(shape: Polytope, noise: float = 1.9) -> Game:
    """Return a game of two agents, 20 apart, in traffic for all 15 steps."""
    start = np.zeros((2, shape.dim))
    start[1, 1] = 20.0
    ahead = 150.0 * np.eye(shape.dim)[0]
    speed = Polytope.box([20.0] * shape.dim)
    gain = 0.5 * np.eye(shape.dim)
    return Game(
        tuple(
            Agent(r, r + ahead, shape, speed, gain=gain, noise=noise * np.eye(shape.dim))
            for r in start
        )
    )


def straight(game: Game) -> Profile:
    """Return the straight plan of each agent."""
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return tuple(plan for plan in plans if plan is not None)


def best(work: Callable[[], object], repeats: int) -> float:
    """Return the least seconds of ``work`` over ``repeats`` runs, after one that fills caches."""
    work()
    spent = []
    for _ in range(repeats):
        started = perf_counter()
        work()
        spent.append(perf_counter() - started)
    return min(spent)
