r"""Players against each other in the environment: arrivals, crashes, expected cost, with intervals.

Episodes run in blocks of copies that all start together; each block's noise comes from the seed
and the block's number alone, so that all players meet the same noise (common random numbers) and
results do not depend on block order or workers.  Cost is the environment's money: lam per step in
traffic and (1 - lam) kappa at a crash, whatever reward the game is played for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator, Step
from ppg_env.env.status import ARRIVED, CRASHED, TRAFFIC
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.support.statistics import Estimate, Interval, proportion

COPIES = 4096
"""Copies per block."""


@dataclass(frozen=True)
class Episodes:
    """Outcome of every episode, in order: (episodes, N) arrays.

    Attributes
    ----------
    arrival : time of arrival; 0 where the agent did not arrive.
    arrived, crashed : whether it ever did.
    cost : its total cost.
    """

    arrival: np.ndarray
    arrived: np.ndarray
    crashed: np.ndarray
    cost: np.ndarray

    @classmethod
    def joined(cls, groups: Sequence[Episodes]) -> Episodes:
        """All episodes of several groups, one after the other."""
        columns = zip(*(vars(group).values() for group in groups), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    def summary(self, confidence: float = 0.95) -> Summary:
        """Means and proportions with intervals."""
        return Summary(
            arrival=[
                mean_interval(times[there], confidence)
                for times, there in zip(self.arrival.T, self.arrived.T, strict=True)
            ],
            success=[_share(column, confidence) for column in self.arrived.T],
            crash=[_share(column, confidence) for column in self.crashed.T],
            crash_any=_share(np.any(self.crashed, axis=1), confidence),
            cost=[mean_interval(column, confidence) for column in self.cost.T],
            cost_mean=mean_interval(self.cost.mean(axis=1), confidence),
        )


@dataclass(frozen=True)
class Summary:
    """Per agent: ``arrival`` (of those who arrive), ``success``, ``crash``, ``cost``; and for all
    together ``crash_any`` and ``cost_mean`` (mean over agents), each with its interval.
    """

    arrival: list[Interval]
    success: list[Estimate]
    crash: list[Estimate]
    crash_any: Estimate
    cost: list[Interval]
    cost_mean: Interval


def evaluate(
    game: Game,
    players: Sequence[Player],
    episodes: int,
    seed: int = 0,
    *,
    group: int = 0,
    rules: Rules | None = None,
    progress: Callable[[int], None] | None = None,
) -> Episodes:
    """Let ``players``, one per agent, play ``episodes`` of ``game`` under ``rules``.

    Groups of episodes with the same seed have independent noise.  ``progress`` is called with the
    number of episodes finished since the last call.

    Raises
    ------
    InputError
        If there is not one player per agent, or no episode to play.
    """
    check_players(game, players)
    require(episodes >= 1, "episodes", f"is {episodes}", "ask for at least one")
    parts = []
    for block in range(-(-episodes // COPIES)):
        wanted = min(COPIES, episodes - block * COPIES)
        simulator, random = _block(game, rules, wanted, seed, group, block)
        parts.append(_play(simulator, players, random))
        if progress is not None:
            progress(wanted)
    return Episodes(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def check_players(game: Game, players: Sequence[Player]) -> None:
    """Refuse players that are not one per agent."""
    require(
        len(players) == len(game.agents),
        "players",
        f"are {len(players)} for {len(game.agents)} agents",
        "give one per agent",
    )


def trajectories(
    game: Game,
    players: Sequence[Player],
    episodes: int,
    seed: int = 0,
    *,
    group: int = 0,
    rules: Rules | None = None,
) -> np.ndarray:
    """(episodes, T + 1, N, n) states of up to ``COPIES`` episodes; nan after an agent has left.

    These are the first episodes that :func:`evaluate` plays.
    """
    require(1 <= episodes <= COPIES, "episodes", f"is {episodes}", f"ask for 1 to {COPIES}")
    simulator, random = _block(game, rules, episodes, seed, group, 0)
    states = [simulator.state.copy()]
    for before, _step in play(simulator, players, _noises(simulator, random)):
        states.append(np.where(before[:, :, None], simulator.state, np.nan))
    return np.stack(states, axis=1)


def _block(
    game: Game, rules: Rules | None, copies: int, seed: int, group: int, number: int
) -> tuple[Simulator, np.random.Generator]:
    """Copies of the game and the source of their noise."""
    starts, noise = np.random.SeedSequence(seed, spawn_key=(group, number)).spawn(2)
    simulator = Simulator(game, rules, copies, starts)
    simulator.reset()
    return simulator, np.random.Generator(np.random.SFC64(noise))


def play(
    simulator: Simulator, players: Sequence[Player], noises: Iterable[np.ndarray]
) -> Iterator[tuple[np.ndarray, Step]]:
    """Play all copies to their ends; who was in traffic before each step (C, N), and the step.

    ``noises`` are the standard normals (C, N, n) of one step after the other.
    """
    C, N, _ = simulator.state.shape
    sizes = [agent.control_dim for agent in simulator.game.agents]
    action = np.zeros((C, N, simulator.action_size))
    for noise in noises:
        traffic = simulator.status == TRAFFIC
        for i, player in enumerate(players):
            if traffic[:, i].any():
                action[:, i, : sizes[i]] = player.act(simulator.view(i))
        yield traffic, simulator.step(action, noise, restart=False)
        # Without restart the kernel would go on moving agents that were truncated: take them out.
        simulator.status[~simulator.alive.any(axis=1)] = CRASHED
        if not simulator.alive.any():
            return


def _noises(simulator: Simulator, random: np.random.Generator) -> Iterator[np.ndarray]:
    C, N, n = simulator.state.shape
    noise = np.empty((COPIES, N, n))  # drawn whole: more episodes only add episodes
    while simulator.alive.any():
        yield random.standard_normal(out=noise)[:C]


def _play(
    simulator: Simulator, players: Sequence[Player], random: np.random.Generator
) -> tuple[np.ndarray, ...]:
    """One block from start to end; (C, N) arrival, arrived, crashed, cost."""
    shape = simulator.status.shape
    arrival, cost = np.zeros(shape), np.zeros(shape)
    arrived = simulator.status == ARRIVED  # at time 0: they started at their goals
    crashed = np.zeros(shape, dtype=bool)
    crash_price = (1 - simulator.lam) * simulator.game.crash_cost
    for traffic, step in play(simulator, players, _noises(simulator, random)):
        live = np.any(step.acting, axis=1, keepdims=True)
        cost += traffic * simulator.lam + (step.crashed & live) * crash_price
        fresh = step.arrived & live
        arrival[fresh] = np.broadcast_to(simulator.clock[:, None], shape)[fresh]
        arrived |= fresh
        crashed |= step.crashed & live
    return arrival, arrived, crashed, cost


def _share(hits: np.ndarray, confidence: float) -> Estimate:
    return proportion(int(hits.sum()), len(hits), confidence)


def mean_interval(values: np.ndarray, confidence: float = 0.95) -> Interval:
    """The mean of independent values with its normal interval."""
    from scipy.stats import norm

    if not values.size:
        return Interval(float("nan"), float("nan"), float("nan"))
    value = float(values.mean())
    half = 0.0
    if values.size > 1:
        half = float(norm.ppf(0.5 + confidence / 2) * values.std(ddof=1) / np.sqrt(values.size))
    return Interval(value, value - half, value + half)
