r"""Crash probabilities of any players in the environment, however small, by multilevel splitting.

An episode is a function of its standard normals z: players act on observations, so the same z
gives the same episode.  Its score is the smallest margin between bodies in the episode, minus
infinity if any agent crashes.  With levels  inf = L_0 > L_1 > ... > L_K >= 0

    Pr(crash) = Pr(score <= L_1) Pr(score <= L_2 | score <= L_1) ... Pr(crash | score <= L_K)

and each factor is large enough to be counted.  States for the next factor start from random ones
below the level and move by

    z' = sqrt(1 - s^2) z + s fresh,     accepted if score(z') <= L,

which keeps the normal distribution given {score <= L} invariant.  Splitting the noise instead of
the state needs no copies of the players' memory, and works if a single step's noise is decisive.

A pilot run finds the levels and the sizes s.  The repetitions keep them fixed, so that every
repetition's product of shares is unbiased.  Their spread gives the standard error.

Source: Au & Beck, Probabilistic Engineering Mechanics 16 (2001); Cerou, Del Moral, Furon &
Guyader, Sequential Monte Carlo for rare event estimation, Statistics and Computing 22 (2012).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import exp, sqrt

import numpy as np

from ppg_env.env.encounter_tables import margin_units
from ppg_env.env.episodes import check_players, play
from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.risk import kernel
from ppg_env.risk.batches import check_request, generator
from ppg_env.support.statistics import RareRisk, counted, proportion, repeated

KEY = 2
"""Separates the noise from that of other methods with the same seed."""

SHARE = 0.1
"""Share of states that pass a level in the pilot run."""

CHAIN = 10
"""States per chain: each random start is moved this often."""

SCOUTS = 4
"""Ratio of the repetitions to those of the pilot run."""

ACCEPTED = 0.45
"""Target share of accepted moves in the pilot run: with fewer, states repeat; with more, moves are
small."""

MOST_LEVELS = 100
"""Largest number of levels in the pilot run; smaller probabilities than 1e-100 do not matter."""


@dataclass(frozen=True)
class Level:
    """A score L to fall below, and the size s of moves below it."""

    score: float
    size: float


class Swarm:
    """R repetitions of P states each, P a multiple of ``CHAIN``, simulated together.

    Attributes
    ----------
    noise : (R, P, T+1, N, n) standard normals, of the start and of every step; N counts moving
        obstacles if any has noise.
    score : (R, P) smallest margin; minus infinity after a crash.
    events : (R, P, N + E + 1) whether each agent, each encounter, any agent crashed.
    episodes : number simulated so far.
    """

    def __init__(
        self,
        game: Game,
        players: Sequence[Player],
        rules: Rules | None,
        shape: tuple[int, int],
        random: np.random.Generator,
        progress: Callable[[int], None],
    ) -> None:
        R, P = shape
        self.players, self.random, self.progress, self.episodes = players, random, progress, 0
        self._batch = (R, P // CHAIN)
        self.simulator = Simulator(game, rules, R * (P // CHAIN))
        self._units = margin_units(game)[0]
        N = len(game.agents)
        self._steps = self.simulator.max_cycles
        self.noise = np.empty((R, P, self._steps + 1, *self.simulator.noise_shape[1:]))
        self.score = np.empty(shape)
        self.events = np.empty((*shape, N + len(game.encounters) + 1), dtype=np.bool_)
        for k in range(CHAIN):
            self._put(k, *self._simulate(random.standard_normal(self._shape)))

    def move(self, score: float, size: float, *, adapt: bool = False) -> float:
        """Replace all states by states below ``score``; return the (adapted) size of moves.

        Repetitions without a state below the level have ended; their states are ignored.
        """
        below = self.score <= score
        pool = np.where(below.any(axis=1, keepdims=True), below, True)
        chosen = np.stack([self.random.choice(np.flatnonzero(row), self._batch[1]) for row in pool])
        rows = np.arange(len(chosen))[:, None]
        current = [array[rows, chosen] for array in (self.noise, self.score, self.events)]
        for k in range(CHAIN):
            fresh = self.random.standard_normal(self._shape)
            trial = self._simulate(sqrt(1 - size**2) * current[0] + size * fresh)
            accepted = trial[1] <= score
            for old, new in zip(current, trial, strict=True):
                old[accepted] = new[accepted]
            self._put(k, *current)
            if adapt:
                size = min(size * exp(accepted.mean() - ACCEPTED), 1.0)
        return size

    @property
    def _shape(self) -> tuple[int, ...]:
        return (*self._batch, *self.noise.shape[2:])

    def _put(self, k: int, noise: np.ndarray, score: np.ndarray, events: np.ndarray) -> None:
        place = slice(k * self._batch[1], (k + 1) * self._batch[1])
        self.noise[:, place], self.score[:, place], self.events[:, place] = noise, score, events

    def _simulate(self, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ``noise`` itself, and the scores and events of its episodes."""
        simulator, tables = self.simulator, self.simulator.tables
        flat = noise.reshape(-1, *noise.shape[2:])
        C, N = simulator.status.shape
        closest, events = np.full(C, np.inf), np.zeros((C, self.events.shape[2]), dtype=np.bool_)
        simulator.reset(noise=flat[:, 0])
        for _, step in play(simulator, self.players, (flat[:, t] for t in range(1, flat.shape[1]))):
            live = np.any(step.acting, axis=1, keepdims=True)
            events[:, :N] |= step.crashed & live
            events[:, N:-1] |= step.overlap & live
            kernel.approach(
                tables.axes, simulator.bodies, simulator.status, simulator.clock, tables.stay,
                tables.pair, tables.normals, tables.offsets, self._units,
                closest,
            )  # fmt: skip
        events[:, -1] = events[:, :N].any(axis=1)
        closest[events[:, -1]] = -np.inf
        self.episodes += C
        self.progress(C)
        return noise, closest.reshape(self._batch), events.reshape(*self._batch, -1)


def find_levels(swarm: Swarm) -> list[Level] | None:
    """Return levels that each about ``SHARE`` of the states pass, until as many crash.

    None if scores stop falling before that.
    """
    levels: list[Level] = []
    size = 1.0
    while swarm.events[..., -1].mean() < SHARE:
        score = float(np.quantile(swarm.score, SHARE, method="lower"))
        lower = np.isfinite(score) and (not levels or score < levels[-1].score)
        if not lower or len(levels) == MOST_LEVELS:
            return None
        size = swarm.move(score, size, adapt=True)
        levels.append(Level(score, size))
    return levels


def split_risk(
    game: Game,
    players: Sequence[Player],
    states: int = 2000,
    seed: int = 0,
    *,
    repetitions: int = 20,
    rules: Rules | None = None,
    confidence: float = 0.95,
    progress: Callable[[int], None] | None = None,
) -> RareRisk:
    """Estimate crash probabilities of ``players``, one per agent, in the environment.

    Parameters
    ----------
    states
        States per factor in each of the independent ``repetitions``, which give the interval;
        rounded up to a multiple of ``CHAIN``.
    progress
        Called with the number of episodes simulated since the last call.

    Raises
    ------
    InputError
        If there is not one player per agent, no state, or less than two repetitions.
    """
    check_players(game, players)
    check_request(states, seed)
    require(repetitions >= 2, "repetitions", f"are {repetitions}", "ask for two or more")
    states = -(-states // CHAIN) * CHAIN
    on_progress = (lambda _count: None) if progress is None else progress
    swarms = (
        Swarm(game, players, rules, (count, states), generator(seed, k, KEY), on_progress)
        for k, count in enumerate((-(-repetitions // SCOUTS), repetitions))
    )
    pilot = next(swarms)
    levels, swarm = find_levels(pilot), next(swarms)
    hits, product = swarm.events.sum(axis=(0, 1)), np.ones(repetitions)
    plain = [proportion(int(count), repetitions * states, confidence) for count in hits]
    for level in levels or ():
        product *= (swarm.score <= level.score).mean(axis=1)
        swarm.move(level.score, level.size)
    shares = product[:, None] * swarm.events.mean(axis=1)  # (R, N + E + 1)
    if levels:
        estimates = [repeated(*pair, confidence) for pair in zip(shares.T, plain, strict=True)]
    else:
        advice = "" if levels is not None else "no way to a crash was found: is there any noise"
        estimates = [counted(estimate, advice) for estimate in plain]
    N = len(game.agents)
    samples = pilot.episodes + swarm.episodes
    return RareRisk(estimates[:N], estimates[N:-1], estimates[-1], samples)
