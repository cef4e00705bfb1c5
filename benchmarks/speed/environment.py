"""Speed of the environment and of other packages, in agent-steps per second on one core.

Rivals are measured in the same run if they are installed, and left out if not: JaxMARL and VMAS
(batched), MPE2 (single), each in its standard task.  All run with precomputed random actions and
with their own resets at the end of an episode.  Where TorchRL is installed as well, its collector
steps this environment and VMAS, with random actions.

Seconds are CPU time, so that other programs on the machine matter less.
"""

from __future__ import annotations

import os
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from time import process_time
from typing import Any

import numpy as np

from benchmarks.speed.measurement import Measurement
from ppg_env.env.episodes import evaluate
from ppg_env.env.normals import Normals
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.players import straight_players
from ppg_env.env.simulator import Simulator
from ppg_env.scenarios.make import make_game

COPIES = 4096


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Run every measurement, all on one core; ``quick`` takes few steps."""
    with on_one_core():
        yield from _measurements(20 if quick else 1000, seed)


@contextmanager
def on_one_core() -> Iterator[None]:
    """Restrict the process, with the threads of its libraries, to one core if the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _measurements(steps: int, seed: int) -> Iterator[Measurement]:
    ours, normals, compiled = batched_rates(steps, seed)
    yield _rate("batched: million agent-steps per second", ours / 1e6)
    yield _rate("batched: share of NumPy's rate of drawing its normals", ours / normals, 0.4)
    yield _rate("batched: drawing its normals, times NumPy's rate", compiled / normals)
    rivals = (("JaxMARL simple_spread", jaxmarl, 10), ("VMAS navigation", vmas, 60))
    for name, rival, target in rivals:
        theirs = _if_installed(rival, max(steps // 10, 2))
        if theirs is not None:
            yield _rate(f"batched: times {name} ({theirs:.3g}/s)", ours / theirs, target)
    yield from _collected(max(steps // 100, 2), seed)
    single = single_rate(10 * steps, seed)
    yield _rate("single: thousand agent-steps per second", single / 1e3)
    theirs = _if_installed(mpe2, steps)
    if theirs is not None:
        yield _rate(f"single: times MPE2 simple_spread ({theirs:.3g}/s)", single / theirs, 10)
    what = f"MiB more after {1e3 * steps:.0e} single and {1e4 * steps:.0e} batched steps"
    yield Measurement(what, memory_growth(1000 * steps, seed), 10)
    yield Measurement("tracking 10^5 episodes of two agents, s", tracking_seconds(steps, seed), 1)


def _collected(batches: int, seed: int) -> Iterator[Measurement]:
    """Measure TorchRL's collector on this environment, and on VMAS, where it is installed."""
    ours = _if_installed(lambda count: torchrl_rate(count, seed), batches)
    if ours is None:
        return
    yield _rate("TorchRL's collector: million agent-steps per second", ours / 1e6)
    theirs = _if_installed(torchrl_vmas, batches)
    if theirs is not None:
        what = f"TorchRL's collector: times VMAS navigation ({theirs:.3g}/s)"
        yield _rate(what, ours / theirs, 5)


def _rate(what: str, value: float, target: float = 0.0) -> Measurement:
    return Measurement(what, value, target, at_least=True)


def batched_rates(steps: int, seed: int) -> tuple[float, float, float]:
    """Return agent-steps per second of the simulator, and of drawing its normals alone.

    These are drawn by NumPy, and last by the simulator's own code, which draws the same ones.
    """
    simulator = Simulator(make_game("head_on"), copies=COPIES, seed=seed)
    simulator.reset()
    shape = (8, COPIES, *simulator.low.shape)
    actions = np.random.default_rng(seed).uniform(-10, 10, shape)
    # Normals are drawn first and last, to average out changes of the machine's speed.
    before = _seconds(lambda k: simulator.random.standard_normal(out=simulator._noise), steps)
    spent = _seconds(lambda k: simulator.step(actions[k % 8]), steps)
    after = _seconds(lambda k: simulator.random.standard_normal(out=simulator._noise), steps)
    draws = Normals()
    own = _seconds(lambda k: draws.fill(simulator.random, simulator._noise), steps)
    work = COPIES * len(simulator.game.agents) * steps
    return work / spent, 2 * work / (before + after), work / own


def single_rate(steps: int, seed: int) -> float:
    """Return agent-steps per second of ``PathPlanningEnv.step``, three agents, with resets."""
    env = PathPlanningEnv("intersection3")
    env.reset(seed=seed)
    random, done = np.random.default_rng(seed), 0
    actions = {a: random.uniform(-10, 10, (64, 2)).astype(np.float32) for a in env.possible_agents}

    def step(k: int) -> None:
        nonlocal done
        if not env.agents:
            env.reset()
        done += len(env.agents)
        env.step({a: actions[a][k % 64] for a in env.agents})

    spent = _seconds(step, steps)
    return done / spent


def memory_growth(steps: int, seed: int) -> float:
    """Return the MiB by which peak memory rises, after a warm-up.

    The environment makes ``steps`` steps, and all copies of a simulator together ten times as many.
    """
    env = PathPlanningEnv("head_on")
    simulator = Simulator(env.game, copies=COPIES, seed=seed)
    simulator.reset()
    env.reset(seed=seed)
    still = {a: np.zeros(2, np.float32) for a in env.possible_agents}

    def run(count: int) -> None:
        for _ in range(count):
            if not env.agents:
                env.reset()
            env.step({a: still[a] for a in env.agents})
        for _ in range(10 * count // COPIES):
            simulator.step(np.zeros(simulator.low.shape))

    run(2000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    run(steps)
    return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024


def tracking_seconds(hundreds: int, seed: int) -> float:
    """Return the seconds for so many hundred episodes of two agents on straight plans."""
    game = make_game("opposing")
    players = straight_players(game)
    evaluate(game, players, 10, seed)
    started = process_time()
    evaluate(game, players, 100 * hundreds, seed)
    return process_time() - started


def jaxmarl(steps: int) -> float:
    """Measure JaxMARL's simple_spread, compiled, vectorised over copies, scanned over steps."""
    import jax
    from jaxmarl import make

    env = make("MPE_simple_spread_v3")
    keys = jax.random.split(jax.random.PRNGKey(0), COPIES)
    _, state = jax.vmap(env.reset)(keys)

    actions = {a: jax.vmap(env.action_space(a).sample)(keys) for a in env.agents}

    def advance(carry: Any, key: Any) -> tuple[Any, Any]:
        keys = jax.random.split(key, COPIES)
        _, carry, reward, _, _ = jax.vmap(env.step)(keys, carry, actions)
        return carry, reward[env.agents[0]].sum()

    run = jax.jit(lambda s, k: jax.lax.scan(advance, s, k))
    chain = jax.random.split(jax.random.PRNGKey(1), steps)
    jax.block_until_ready(run(state, chain))
    started = process_time()
    jax.block_until_ready(run(state, chain))
    return COPIES * env.num_agents * steps / (process_time() - started)


def vmas(steps: int) -> float:
    """Measure VMAS's navigation, batched, on one thread."""
    import torch
    from vmas import make_env

    torch.set_num_threads(1)
    env = make_env("navigation", num_envs=COPIES, device="cpu", continuous_actions=True, seed=0)
    env.reset()
    actions = [env.get_random_action(agent) for agent in env.agents]
    spent = _seconds(lambda k: env.step(actions), steps)
    return COPIES * len(env.agents) * steps / spent


def torchrl_rate(batches: int, seed: int) -> float:
    """Measure TorchRL's collector on this environment, three agents."""
    from baselines import GameTorchRLEnv

    return collected_rate(GameTorchRLEnv("intersection3", COPIES, seed=seed), batches)


def torchrl_vmas(batches: int) -> float:
    """Measure TorchRL's collector on VMAS's navigation."""
    from torchrl.envs import VmasEnv

    import_module("vmas")  # TorchRL says only later that it is missing
    return collected_rate(VmasEnv("navigation", num_envs=COPIES, seed=0, device="cpu"), batches)


def collected_rate(env: Any, batches: int) -> float:
    """Return agent-steps per second of a collector of batches of ten steps, on one thread."""
    import torch
    from torchrl.collectors import Collector

    torch.set_num_threads(1)
    frames = 10 * COPIES
    collector = Collector(env, None, frames_per_batch=frames, total_frames=frames * (batches + 1))
    batch = iter(collector)
    spent = _seconds(lambda _: next(batch), batches)
    collector.shutdown()
    agents = sum(len(names) for names in env.group_map.values())
    return frames * agents * batches / spent


def mpe2(steps: int) -> float:
    """Measure MPE2's simple_spread with three agents, with resets."""
    from mpe2 import simple_spread_v3

    env = simple_spread_v3.parallel_env()
    env.reset(seed=0)
    done = 0

    def step(k: int) -> None:
        nonlocal done
        if not env.agents:
            env.reset()
        done += len(env.agents)
        env.step(dict.fromkeys(env.agents, k % 5))

    spent = _seconds(step, steps)
    return done / spent


def _seconds(work: Callable[[int], object], steps: int) -> float:
    work(0)
    started = process_time()
    for k in range(steps):
        work(k)
    return process_time() - started


def _if_installed(rival: Callable[[int], float], steps: int) -> float | None:
    try:
        return rival(steps)
    except ImportError:
        return None
