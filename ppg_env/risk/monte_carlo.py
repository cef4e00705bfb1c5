r"""Monte Carlo of a profile's noisy closed loop, on its schedule.

    x_{t+1} = A x_t + B u_t + w_t,  u_t = ubar_t - gain (x_t - xbar_t),  w_t ~ N(0, noise)

An agent crashes in an episode if, in traffic, it overlaps another agent or an obstacle (touching
is no overlap): at a time step, or where the game says ``collisions="swept"`` during a step
(:mod:`ppg_env.risk.crash_events`).  Crashed agents are not removed, so that the counted event is
that of the union bound.

Episodes run in blocks, each with its own noise: results do not depend on the number of workers,
and profiles of one game meet the same noise.  Memory does not grow with the number of episodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from operator import add
from typing import TypeVar

import numpy as np

from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.risk.batches import check_request, generator, over_blocks
from ppg_env.risk.crash_events import OverlapRecord, make_crash_model
from ppg_env.risk.error_process import mergeable
from ppg_env.support.statistics import Estimate, Interval, difference, proportion


@dataclass(frozen=True, eq=False)
class CrashCounts:
    """Counts of crashes in ``samples`` episodes.  N agents, E encounters, times 0..H.

    Attributes
    ----------
    agents : (N,) episodes in which each agent crashed.
    times : (E, H+1) episodes in which each encounter overlapped at each time; if swept, in the
        step that ends then.
    first_times : (E, H+1) those in which it did for the first time.
    first_any : (H+1,) episodes whose first crash of any agent was at each time.
    """

    samples: int
    agents: np.ndarray
    times: np.ndarray
    first_times: np.ndarray
    first_any: np.ndarray

    @property
    def any(self) -> int:
        """Episodes in which any agent crashed."""
        return int(self.first_any.sum())

    @property
    def encounters(self) -> np.ndarray:
        """(E,) episodes in which each encounter overlapped at least once."""
        return self.first_times.sum(axis=1)

    def __add__(self, other: CrashCounts) -> CrashCounts:
        return CrashCounts(*map(add, vars(self).values(), vars(other).values()))

    def estimates(self, confidence: float = 0.95) -> tuple[list[Estimate], Estimate]:
        """Return the crash probability of each agent, and of any of them."""
        return self.each(self.agents, confidence), proportion(self.any, self.samples, confidence)

    def each(self, hits: np.ndarray, confidence: float = 0.95) -> list[Estimate]:
        """Return the probability of each of ``hits``, such as ``encounters`` or ``first_any``."""
        return [proportion(int(count), self.samples, confidence) for count in hits]


@dataclass(frozen=True, eq=False)
class PairedCounts:
    """Two counts of the same episodes: for two profiles, or at instants and swept.

    Attributes
    ----------
    first, second : the two counts.
    only_first, only_second : (N+1,) episodes in which the agent (last: any agent) crashed in one
        of them and not in the other.
    """

    first: CrashCounts
    second: CrashCounts
    only_first: np.ndarray
    only_second: np.ndarray

    def __add__(self, other: PairedCounts) -> PairedCounts:
        return PairedCounts(*map(add, vars(self).values(), vars(other).values()))

    def differences(self, confidence: float = 0.95) -> tuple[list[Interval], Interval]:
        """Return second minus first crash probability, of each agent and of any of them."""
        *each, any_agent = (
            difference(int(more), int(less), self.first.samples, confidence)
            for more, less in zip(self.only_second, self.only_first, strict=True)
        )
        return each, any_agent


Counts = TypeVar("Counts", CrashCounts, PairedCounts)


def crash_counts(
    game: Game,
    profile: Profile,
    samples: int,
    seed: int = 0,
    *,
    swept: bool | None = None,
    start: int = 0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> CrashCounts:
    """Simulate ``samples`` episodes of ``profile`` and count the crashes.

    Parameters
    ----------
    samples, seed
        Number of episodes; the seed fixes all of them.
    swept
        Whether overlaps count during the steps, or at the instants only; by default as ``game``
        says.
    start
        Episodes, a multiple of 1,024, that an earlier piece has counted: the sum of the pieces
        equals the count of all episodes at once.
    workers
        Number of threads.
    progress
        Called with the number of episodes finished since the last call.

    Raises
    ------
    InputError
        If there is no episode to simulate, the seed is negative, or ``start`` is no multiple.
    """
    model = make_crash_model(game, profile, swept=swept)
    starts, scratch = bool(model.processes.sigma0.any()), model.processes.scratch(model.steps)

    def block(number: int, episodes: int) -> CrashCounts:
        errors = model.processes.draw(generator(seed, number), scratch(), starts)
        return _counts(model.watch(errors, episodes), episodes)

    check_request(samples, seed, start)
    return _total(over_blocks(block, samples, workers, start), progress)


def paired_counts(
    first: tuple[Game, Profile],
    second: tuple[Game, Profile],
    samples: int,
    seed: int = 0,
    *,
    swept: tuple[bool | None, bool | None] = (None, None),
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> PairedCounts:
    """Count the crashes of two profiles under common random numbers, or of one in two ways.

    Both meet the same standard normals.  Their games may differ, except in the number of agents
    and of their states; if another number of obstacles moves with noise, the normals are
    independent.  ``swept`` says which count is swept; other arguments are those of
    :func:`crash_counts`.

    Raises
    ------
    InputError
        If the agents do not correspond, or for the reasons of :func:`crash_counts`.
    """
    games = (first[0], second[0])
    sizes = [[agent.state_dim for agent in game.agents] for game in games]
    require(
        sizes[0] == sizes[1],
        "the second plan",
        f"has states of sizes {sizes[1]} where the first has {sizes[0]}",
        "compare plans for the same agents",
    )
    flown = (first, second)
    merge = all(mergeable(game, [plan.arrival for plan in profile]) for game, profile in flown)
    models = [
        make_crash_model(game, profile, swept=sweep, merge=merge)
        for (game, profile), sweep in zip(flown, swept, strict=True)
    ]
    starts = any(model.processes.sigma0.any() for model in models)
    steps = max(model.steps for model in models)
    rests = [model.processes.rests.tolist() for model in models]
    shared = games[0] is games[1] and rests[0] == rests[1]
    scratches = [model.processes.scratch(steps) for model in models]

    def block(number: int, episodes: int) -> PairedCounts:
        errors = [models[0].processes.draw(generator(seed, number), scratches[0](), starts)] * 2
        if not shared:  # the same normals in other error dynamics
            errors[1] = models[1].processes.draw(generator(seed, number), scratches[1](), starts)
        records = [m.watch(e, episodes) for m, e in zip(models, errors, strict=True)]
        a, b = (np.vstack([r.crashed, r.met.any(axis=0)]) for r in records)
        counts = [_counts(record, episodes) for record in records]
        return PairedCounts(counts[0], counts[1], (a & ~b).sum(axis=1), (b & ~a).sum(axis=1))

    check_request(samples, seed)
    return _total(over_blocks(block, samples, workers), progress)


def _counts(record: OverlapRecord, episodes: int) -> CrashCounts:
    return CrashCounts(
        episodes, record.crashed.sum(axis=1), record.times, record.first_times, record.first_any
    )


def _total(blocks: Iterable[tuple[int, Counts]], progress: Callable[[int], None] | None) -> Counts:
    """Add up the counts of all blocks."""
    totals: list[Counts] = []
    for episodes, counts in blocks:
        totals = [totals[0] + counts if totals else counts]
        if progress is not None:
            progress(episodes)
    return totals[0]
