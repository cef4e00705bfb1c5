r"""Crash probabilities of a profile, however small, by importance sampling.

Half-spaces H_1..H_C of the noise cover all crashes (:mod:`ppg_env.risk.covering_halfspaces`).
Q_c is the probability of H_c, and sum Q_c is at most the paper's union bound.  First c is drawn
with probability w_c, then an episode *given* H_c: a mixture over encounters, times and faces.
Its density relative to that of a plain episode is

    D = sum_c w_c [episode in H_c] / Q_c,     so    Pr(crash) = E[Y],   Y = [crash] / D,

which is unbiased for any half-spaces.  A crash lies in some H_c, hence Y <= max_c Q_c / w_c:
weights cannot explode, and the mass that the samples may have missed is bounded.  Weights

    w_c = mean over agents i of  Q_c [i meets in c] / (sum of the Q of i)

give every agent its share of episodes, so that one simulation serves all agents.  With one
agent or two, D is the number of half-spaces that hold over the union bound: counting corrects
the bound.

Source: Owen, Maximov & Chertkov, Importance sampling the union of rare events, Electronic Journal
of Statistics 13 (2019); Adler, Blanchet & Liu, Annals of Applied Probability 22 (2012).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import add

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.margins import membership
from ppg_env.game.plan import Profile
from ppg_env.risk import kernel
from ppg_env.risk.batches import BLOCK, check_request, generator, over_blocks
from ppg_env.risk.covering_halfspaces import HalfSpaces, cover
from ppg_env.risk.crash_events import CrashModel, make_crash_model
from ppg_env.support.statistics import RareEstimate, RareRisk, weighted

IN_SIGHT = 100_000
"""Default number of episodes: standard errors are then mostly far below one percent."""

KEY = 1
"""Separates the noise from that of plain Monte Carlo with the same seed."""


@dataclass(frozen=True, eq=False)
class _Sums:
    """Sums over episodes for each target: crashes, Y and Y^2."""

    hits: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    def __add__(self, other: _Sums) -> _Sums:
        return _Sums(*map(add, vars(self).values(), vars(other).values()))


@dataclass(frozen=True, eq=False)
class CrashWeights:
    """Weighted crashes of one simulation, from which intervals at any confidence are drawn.

    The targets are N agents, E encounters and any of them; swept, then the same again for crashes
    that no instant shows.

    Attributes
    ----------
    samples : simulated episodes.
    agents : number N of agents.
    hits : (targets,) episodes with a crash.
    total, squares : (targets,) sums of Y and of Y^2, in ``unit`` and its square.
    ceilings : (targets,) largest possible Y.
    unit : scale of the sums, because squares of small numbers underflow.
    swept : whether crashes between instants are included.
    """

    samples: int
    agents: int
    hits: np.ndarray
    total: np.ndarray
    squares: np.ndarray
    ceilings: np.ndarray
    unit: float
    swept: bool

    def risk(self, confidence: float = 0.95) -> RareRisk:
        """Return the crash probabilities with intervals at ``confidence``."""
        columns = zip(self.hits, self.total, self.squares, self.ceilings, strict=True)
        estimates = [
            weighted(
                int(hits),
                self.samples,
                float(total),
                float(squares),
                self.unit,
                float(ceiling),
                confidence,
            )
            for hits, total, squares, ceiling in columns
        ]
        if not self.swept:
            return self._risk(estimates)
        half = len(estimates) // 2
        return self._risk(estimates[:half], self._risk(estimates[half:]))

    def _risk(self, estimates: list[RareEstimate], between: RareRisk | None = None) -> RareRisk:
        N = self.agents
        return RareRisk(estimates[:N], estimates[N:-1], estimates[-1], self.samples, between)


def rare_risk(
    game: Game,
    profile: Profile,
    samples: int = IN_SIGHT,
    seed: int = 0,
    *,
    swept: bool | None = None,
    confidence: float = 0.95,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> RareRisk:
    """Estimate the crash probabilities of ``profile`` from ``samples`` weighted episodes.

    The counted events, and the arguments, are those of
    :func:`ppg_env.risk.monte_carlo.crash_counts`.  If swept, what the steps add to the instants
    comes from the same episodes, as ``between``.  For intervals at several levels of
    confidence, simulate once with :func:`crash_weights`.

    Raises
    ------
    InputError
        If there is no episode to simulate, or the seed is negative.
    """
    weights = crash_weights(
        game, profile, samples, seed, swept=swept, workers=workers, progress=progress
    )
    return weights.risk(confidence)


def crash_weights(
    game: Game,
    profile: Profile,
    samples: int = IN_SIGHT,
    seed: int = 0,
    *,
    swept: bool | None = None,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> CrashWeights:
    """Simulate ``samples`` weighted episodes.

    Arguments and errors are those of :func:`rare_risk`.
    """
    check_request(samples, seed)
    model = make_crash_model(game, profile, swept=swept)
    instants = make_crash_model(game, profile, swept=False) if model.swept else None
    halves, everything = cover(model), np.ones((1, len(game.encounters)), dtype=bool)
    members = np.vstack([membership(game), np.eye(everything.size, dtype=bool), everything])
    within = members[:, halves.encounter]  # (targets, C)
    weights = _weights(halves, within[: len(game.agents)])
    ceilings = np.where(within, halves.tails / weights, 0.0).max(axis=1, initial=0.0)
    if model.swept:  # what steps add to instants is an event of its own, for every target
        ceilings = np.tile(ceilings, 2)
    unit = float(ceilings.max(initial=0.0))
    sums = _Sums(*(np.zeros(len(ceilings)) for _ in range(3)))
    if unit:
        rates, scratch = unit * weights / halves.tails, model.processes.scratch(model.steps)

        def block(number: int, episodes: int) -> _Sums:
            random, starts = generator(seed, number, KEY), bool(model.processes.sigma0.any())
            errors = model.processes.draw(random, scratch(), starts)
            return _block(model, instants, halves, weights, rates, errors, random, episodes)

        for episodes, part in over_blocks(block, samples, workers):
            sums = sums + part
            if progress is not None:
                progress(episodes)
    return CrashWeights(
        samples=samples,
        agents=len(game.agents),
        **vars(sums),
        ceilings=ceilings,
        unit=unit,
        swept=model.swept,
    )


def _weights(halves: HalfSpaces, within: np.ndarray) -> np.ndarray:
    """Return (C,) mixture weights w; ``within`` (N, C) says which half-spaces concern an agent."""
    shares = within * halves.tails
    sums = shares.sum(axis=1, keepdims=True)
    concerned = sums[:, 0] > 0
    return (shares[concerned] / sums[concerned]).sum(axis=0) / max(concerned.sum(), 1)


def _block(
    model: CrashModel,
    instants: CrashModel | None,
    halves: HalfSpaces,
    weights: np.ndarray,
    rates: np.ndarray,
    errors: np.ndarray,
    random: np.random.Generator,
    episodes: int,
) -> _Sums:
    """Condition a block of plain deviations and sum its weighted crashes.

    With ``instants``, sum the crashes of ``model`` that this other model misses too.
    """
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
    if instants is not None:
        crashed = np.vstack([crashed, crashed & ~_crashed(instants, errors, episodes)])
    values = np.zeros(crashed.shape)
    np.divide(1.0, density[:episodes], out=values, where=crashed)
    return _Sums(crashed.sum(axis=1), values.sum(axis=1), (values**2).sum(axis=1))


def _crashed(model: CrashModel, errors: np.ndarray, episodes: int) -> np.ndarray:
    """Return (N + E + 1, episodes) whether each agent, each encounter, any agent crashed."""
    record = model.watch(errors, episodes)
    return np.vstack([record.crashed, record.met, record.met.any(axis=0)])[:, :episodes]
