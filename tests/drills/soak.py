"""The drill ``soak``: environment steps without end, in memory that does not grow."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env import make_game
from ppg_env.env import Near, Randomize, Simulator, Uniform
from ppg_env.path_planning_v0 import parallel_env
from tests.drills.figures import Figure

STEPS = 1_000_000_000
"""Agent steps of the batch in a night."""

PARTS, COPIES, GROWTH = 50, 4096, 1.01


def drill(size: float) -> Iterator[Figure]:
    """Step batches and single environments, and watch the resident size."""
    game, steps = make_game("intersection", speed="l1"), STEPS * size
    draws = Randomize(start=Near(2.0), lam=Uniform(0.1, 0.9))
    yield _soaked("a batch of 4,096 copies", steps, _batch(Simulator(game, copies=COPIES)))
    drawn = Simulator(game, copies=COPIES, randomize=draws)
    yield _soaked("the same with random starts and weights", steps / 10, _batch(drawn))
    yield _soaked("the PettingZoo environment", steps / 500, _single(parallel_env(game)))


def _soaked(what: str, steps: float, run: Callable[[float], float]) -> Figure:
    """Run in parts; ``run`` takes agent steps and returns how many it did."""
    run(steps / PARTS)  # caches fill
    sizes, done, started = [], 0.0, time.process_time()
    for _ in range(PARTS):
        done += run(steps / PARTS)
        sizes.append(resident())
    rate = done / (time.process_time() - started)
    first, second = max(sizes[: PARTS // 2]), max(sizes[PARTS // 2 :])
    grown = [f"grew from {first:.1f} to {second:.1f} MiB"] if second > GROWTH * first else []
    return Figure(
        what,
        f"{done:,.0f} agent steps",
        f"{rate:,.0f} per CPU second; at most {first:.1f} MiB in the first half, "
        f"{second:.1f} MiB in the second",
        tuple(grown),
    )


def _batch(simulator: Simulator) -> Callable[[float], float]:
    random = np.random.default_rng(0)
    shape = (simulator.copies, len(simulator.game.agents), simulator.action_size)
    actions = [random.uniform(-5, 5, shape) for _ in range(8)]
    simulator.reset()

    def run(steps: float) -> float:
        count = max(1, round(steps / (shape[0] * shape[1])))
        for k in range(count):
            simulator.step(actions[k % 8])
        return count * float(shape[0] * shape[1])

    return run


def _single(env: Any) -> Callable[[float], float]:
    random = np.random.default_rng(0)

    def run(steps: float) -> float:
        done, seed = 0, 0
        while done < steps:
            env.reset(seed=seed)
            seed += 1
            while env.agents:
                env.step({agent: random.uniform(-5, 5, 2) for agent in env.agents})
                done += 2
        return float(done)

    return run


def resident() -> float:
    """Return the resident size in MiB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / (1 << 20)
