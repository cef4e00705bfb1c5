"""Speed of PPO's training loop over the batched simulator, and the environment's share of it."""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any

from benchmarks.speed.environment import on_one_core
from benchmarks.speed.measurement import Measurement
from ppg_env.scenarios.make import make_game

ROLLOUTS = 40


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Train shortly in ``head_on`` with l1 speed, with the settings of ``ppg train``."""
    from baselines.ppo import make_learner
    from baselines.train import require_extra
    from baselines.training_loop import Args, Turn, take_turns

    require_extra()
    rollouts = 2 if quick else ROLLOUTS
    args = Args(make_game("head_on", speed="l1"), seed=seed)
    with on_one_core():
        learner = make_learner(args)
        take_turns(args, [learner], [Turn(0, 1)])  # compile, warm up
        spent = _timed(learner.env, "step_wait", "step_async")
        started = perf_counter()
        take_turns(args, [learner], [Turn(0, rollouts)])
        total = perf_counter() - started
    steps = rollouts * learner.rollout
    yield Measurement("thousand environment steps per second", steps / total / 1e3, 15, True)
    yield Measurement("environment's share of the time, %", 100 * sum(spent) / total, 10)


def _timed(thing: Any, *methods: str) -> list[float]:
    """Replace methods by ones that append their seconds to the returned list."""
    spent: list[float] = []

    def wrapped(method: Any) -> Any:
        def call(*args: Any) -> Any:
            started = perf_counter()
            try:
                return method(*args)
            finally:
                spent.append(perf_counter() - started)

        return call

    for name in methods:
        setattr(thing, name, wrapped(getattr(thing, name)))
    return spent
