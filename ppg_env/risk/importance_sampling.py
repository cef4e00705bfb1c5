r"""Crash probabilities of a profile, however small, by sampling episodes with a crash in sight.

Half-spaces H_1..H_C of the noise cover all crashes (:mod:`ppg_env.risk.covering_halfspaces`); Q_c
is the
probability of H_c, and sum Q_c is at most the paper's union bound.  An episode is drawn *given*
H_c, c having been drawn with probability w_c: a mixture over encounters, times and faces.  Its
density relative to that of a plain episode is

    D = sum_c w_c [episode in H_c] / Q_c,     so    Pr(crash) = E[Y],   Y = [crash] / D,

which is unbiased whatever the half-spaces.  A crash lies in some H_c, hence Y <= max_c Q_c / w_c:
weights cannot explode, and what the samples may have missed is bounded too.  Weights

    w_c = mean over agents i of  Q_c [i meets in c] / (sum of the Q of i)

give every agent its share of episodes; one set of them serves all.  With one agent, or two, D
is the number of half-spaces that hold over the union bound: the bound is corrected by counting.

Source: Owen, Maximov & Chertkov, Importance sampling the union of rare events, Electronic Journal
of Statistics 13 (2019); Adler, Blanchet & Liu, Annals of Applied Probability 22 (2012).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import add

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.margins import membership
from ppg_env.game.plan import Profile
from ppg_env.risk import kernel
from ppg_env.risk.batches import BLOCK, check_request, generator, over_blocks
from ppg_env.risk.covering_halfspaces import HalfSpaces, cover
from ppg_env.risk.crash_events import CrashModel, make_crash_model
from ppg_env.risk.error_process import error_processes
from ppg_env.support.statistics import RareRisk, weighted

IN_SIGHT = 100_000
"""Episodes unless told otherwise: standard errors are then far below a percent, mostly."""

KEY = 1
"""Sets the noise apart from that of plain Monte Carlo with the same seed."""


@dataclass(frozen=True, eq=False)
class _Sums:
    """Over episodes, for each target: those with a crash, sum of Y and of Y^2."""

    hits: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    def __add__(self, other: _Sums) -> _Sums:
        return _Sums(*map(add, vars(self).values(), vars(other).values()))


def rare_risk(
    game: Game,
    profile: Profile,
    samples: int = IN_SIGHT,
    seed: int = 0,
    *,
    swept: bool = False,
    confidence: float = 0.95,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> RareRisk:
    """Estimate the crash probabilities of ``profile`` from ``samples`` weighted episodes.

    The counted events, and the arguments, are those of
    :func:`ppg_env.risk.monte_carlo.crash_counts`.  With ``swept``, what the steps add to the
    instants comes from the same episodes, as ``between``.

    Raises
    ------
    InputError
        If there is no episode to simulate, or the seed is negative.
    """
    check_request(samples, seed)
    model = make_crash_model(game, profile, error_processes(game), swept=swept)
    halves, everything = cover(model), np.ones((1, len(game.encounters)), dtype=bool)
    members = np.vstack([membership(game), np.eye(everything.size, dtype=bool), everything])
    within = members[:, halves.encounter]  # (targets, C)
    weights = _weights(halves, within[: len(game.agents)])
    ceilings = np.where(within, halves.tails / weights, 0.0).max(axis=1, initial=0.0)
    if swept:  # what steps add to instants is an event of its own, for every target
        ceilings = np.tile(ceilings, 2)
    unit = float(ceilings.max(initial=0.0))  # Y is summed in units of this: squares underflow
    sums = _Sums(*(np.zeros(len(ceilings)) for _ in range(3)))
    if unit:
        rates, scratch = unit * weights / halves.tails, model.processes.scratch(model.steps)

        def block(number: int, episodes: int) -> _Sums:
            random, starts = generator(seed, number, KEY), bool(model.processes.sigma0.any())
            errors = model.processes.draw(random, scratch(), starts)
            return _block(model, halves, weights, rates, errors, random, episodes)

        for episodes, part in over_blocks(block, samples, workers):
            sums = sums + part
            if progress is not None:
                progress(episodes)
    found = [
        weighted(int(hits), samples, float(total), float(squares), unit, float(most), confidence)
        for hits, total, squares, most in zip(*vars(sums).values(), ceilings, strict=True)
    ]
    N, K = len(game.agents), len(members)
    between = RareRisk(found[K : K + N], found[K + N : -1], found[-1], samples) if swept else None
    return RareRisk(found[:N], found[N : K - 1], found[K - 1], samples, between)


def _weights(halves: HalfSpaces, within: np.ndarray) -> np.ndarray:
    """(C,) mixture weights w, from which half-spaces concern each agent (N, C)."""
    shares = within * halves.tails
    sums = shares.sum(axis=1, keepdims=True)
    concerned = sums[:, 0] > 0
    return (shares[concerned] / sums[concerned]).sum(axis=0) / max(concerned.sum(), 1)


def _block(
    model: CrashModel,
    halves: HalfSpaces,
    weights: np.ndarray,
    rates: np.ndarray,
    errors: np.ndarray,
    random: np.random.Generator,
    episodes: int,
) -> _Sums:
    """Weighted crashes of a block of plain deviations, once conditioned."""
    from scipy.special import ndtri

    edges = np.cumsum(weights)
    which = np.searchsorted(edges, random.random(BLOCK) * edges[-1], side="right")
    wanted = ndtri(halves.tails[which] * (1.0 - random.random(BLOCK)))
    kernel.condition(
        errors, which, wanted, halves.parties, halves.times, halves.normals, halves.deviations,
        halves.responses,
    )  # fmt: skip
    density = np.zeros(BLOCK)
    kernel.densities(
        errors, halves.parties, halves.times, halves.normals, halves.offsets, rates, density
    )
    crashed = _crashed(model, errors, episodes)
    if model.swept:
        instants = _crashed(replace(model, swept=False), errors, episodes)
        crashed = np.vstack([crashed, crashed & ~instants])
    values = np.zeros(crashed.shape)
    np.divide(1.0, density[:episodes], out=values, where=crashed)
    return _Sums(crashed.sum(axis=1), values.sum(axis=1), (values**2).sum(axis=1))


def _crashed(model: CrashModel, errors: np.ndarray, episodes: int) -> np.ndarray:
    """(N + E + 1, episodes) whether each agent, each encounter, anybody crashed."""
    seen = model.watch(errors, episodes)
    return np.vstack([seen.crashed, seen.met, seen.met.any(axis=0)])[:, :episodes]
