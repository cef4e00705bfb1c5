r"""Monte Carlo of a profile's noisy closed loop, on its schedule.

    x_{t+1} = A x_t + B u_t + w_t,  u_t = ubar_t - gain (x_t - xbar_t),  w_t ~ N(0, noise)

Deviations from the mean follow  e_{t+1} = (A - B gain) e_t + w_t  whatever the plan, so they
are drawn once per block and laid over the means.  An agent crashes in an episode if, at any
time in traffic, it overlaps another agent or an obstacle (touching is no overlap); it is not
removed then, so that the counted event is the one the union bound is about.

Episodes come in blocks of fixed size, each with a generator of its own made from the seed and
the block's number: results do not depend on workers, and profiles of one game are compared
under the same noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.dynamics import square_root
from ppg_env.errors import require
from ppg_env.game import Game
from ppg_env.plan import Profile

BLOCK = 8192
"""Episodes per block: small enough for the cache, large enough to hide Python's overhead."""


@dataclass(frozen=True)
class Estimate:
    """A probability with its Clopper-Pearson interval.

    ``hits`` of ``samples`` episodes; ``value`` is their ratio, and [low, high] covers the true
    probability with the stated confidence.
    """

    hits: int
    samples: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Share of episodes with the event."""
        return self.hits / self.samples


@dataclass(frozen=True)
class CrashCounts:
    """Episodes with a crash, of ``samples``.

    Attributes
    ----------
    agents : (N,) episodes in which each agent crashed.
    any : episodes in which anybody did.
    """

    samples: int
    agents: np.ndarray
    any: int

    def __add__(self, other: CrashCounts) -> CrashCounts:
        return CrashCounts(
            self.samples + other.samples, self.agents + other.agents, self.any + other.any
        )

    def estimates(self, confidence: float = 0.95) -> tuple[list[Estimate], Estimate]:
        """Crash probability of each agent, and of any of them."""
        each = [proportion(int(hits), self.samples, confidence) for hits in self.agents]
        return each, proportion(self.any, self.samples, confidence)


def proportion(hits: int, samples: int, confidence: float = 0.95) -> Estimate:
    """The exact (Clopper-Pearson) interval of a binomial proportion."""
    from scipy.stats import binomtest

    interval = binomtest(hits, samples).proportion_ci(confidence, method="exact")
    return Estimate(hits, samples, float(interval.low), float(interval.high))


def crash_counts(
    game: Game,
    profile: Profile,
    samples: int,
    seed: int = 0,
    *,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> CrashCounts:
    """Simulate ``samples`` episodes of ``profile`` and count the crashes.

    Parameters
    ----------
    samples, seed
        Number of episodes; the seed fixes every one of them.
    workers
        Threads; NumPy releases the interpreter while it draws and multiplies.
    progress
        Called with the number of episodes finished since the last call.
    """
    require(samples >= 1, "samples", f"is {samples}", "ask for at least one episode")
    require(seed >= 0, "seed", f"is {seed}", "give a number that is not negative")
    jobs = [(b, min(BLOCK, samples - b * BLOCK)) for b in range(-(-samples // BLOCK))]
    total = CrashCounts(0, np.zeros(len(game.agents), dtype=np.int64), 0)
    for counts in _map(lambda job: _block(game, profile, seed, *job), jobs, workers):
        total = total + counts
        if progress is not None:
            progress(counts.samples)
    return total


def deviations(
    game: Game, random: np.random.Generator, episodes: int, steps: int
) -> Iterator[np.ndarray]:
    """Yield e_t = x_t - xbar_t for t = 0..``steps`` as arrays (episodes, N, d) of positions.

    The noise of a step does not depend on ``steps``, so a longer run continues a shorter one.
    """
    agents = game.agents
    state = [_draw(random, agent.sigma0, episodes) for agent in agents]
    roots = [square_root(agent.noise) for agent in agents]
    yield _positions(game, state)
    for _ in range(steps):
        for i, agent in enumerate(agents):
            fresh = random.standard_normal((episodes, agent.state_dim)) @ roots[i].T
            state[i] = state[i] @ agent.closed_loop.T + fresh
        yield _positions(game, state)


def _block(game: Game, profile: Profile, seed: int, number: int, episodes: int) -> CrashCounts:
    random = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(number,))))
    last = [game.horizon + 1 if plan.arrival is None else plan.arrival for plan in profile]
    until = [min(last[i] for i in e.agents) for e in game.encounters]
    crashed = np.zeros((len(game.agents), episodes), dtype=bool)
    means = np.array([plan.means[:, : game.dim] for plan in profile])
    # A full block is drawn even if fewer episodes are asked for: more samples only add episodes.
    for t, error in enumerate(deviations(game, random, BLOCK, max(until, default=1) - 1)):
        for encounter, end in zip(game.encounters, until, strict=True):
            if t >= end:
                continue
            where = encounter.displacement(*(error[:episodes, i] for i in encounter.agents))
            nominal = encounter.displacement(*(means[i, t] for i in encounter.agents))
            room = encounter.collision.offsets - encounter.collision.normals @ nominal - tol.LENGTH
            inside = np.ones(episodes, dtype=bool)
            for normal, limit in zip(encounter.collision.normals, room, strict=True):
                inside &= where @ normal <= limit
            for i in encounter.agents:
                crashed[i] |= inside
    return CrashCounts(episodes, crashed.sum(axis=1), int(crashed.any(axis=0).sum()))


def _map(
    function: Callable[[tuple[int, int]], CrashCounts], jobs: list[tuple[int, int]], workers: int
) -> Iterator[CrashCounts]:
    if workers == 1:
        yield from map(function, jobs)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(function, jobs)


def _positions(game: Game, state: list[np.ndarray]) -> np.ndarray:
    return np.stack([errors[:, : game.dim] for errors in state], axis=1)


def _draw(random: np.random.Generator, covariance: np.ndarray, episodes: int) -> np.ndarray:
    root = square_root(covariance)
    if not root.any():
        return np.zeros((episodes, len(root)))
    return random.standard_normal((episodes, len(root))) @ root.T
