r"""Episodes of players in the environment: arrivals, crashes and costs, with intervals.

Episodes run in blocks of copies that all start together.  Each block's noise comes from the seed
and the block's number alone, so that all players meet the same noise (common random numbers) and
results do not depend on block order or workers.  Costs are lam per step in traffic, the effort,
and (1 - lam) kappa at a crash, for any choice of reward.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.env.actions import player_action
from ppg_env.env.players import Player
from ppg_env.env.randomize import Randomize
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.env.status import ARRIVED, CRASHED, TRAFFIC
from ppg_env.env.step import Step
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.support.linear_algebra import one_thread
from ppg_env.support.statistics import Estimate, Interval, proportion

COPIES = 4096
"""Copies per block."""


@dataclass(frozen=True)
class Episodes:
    """Outcomes of episodes, in order: (episodes, N) arrays.

    Attributes
    ----------
    arrival : time of arrival; 0 where the agent did not arrive.
    arrived, crashed : whether the agent arrived, or crashed, at any time.
    cost : total cost of the agent.
    """

    arrival: np.ndarray
    arrived: np.ndarray
    crashed: np.ndarray
    cost: np.ndarray

    @classmethod
    def joined(cls, groups: Sequence[Episodes]) -> Episodes:
        """Return the episodes of several groups, one group after the other."""
        columns = zip(*(vars(group).values() for group in groups), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    def summary(self, confidence: float = 0.95) -> Summary:
        """Return means and proportions with intervals."""
        return Summary(
            arrival=[
                mean_interval(times[arrived], confidence)
                for times, arrived in zip(self.arrival.T, self.arrived.T, strict=True)
            ],
            success=[_share(column, confidence) for column in self.arrived.T],
            crash=[_share(column, confidence) for column in self.crashed.T],
            crash_any=_share(np.any(self.crashed, axis=1), confidence),
            cost=[mean_interval(column, confidence) for column in self.cost.T],
            cost_mean=mean_interval(self.cost.mean(axis=1), confidence),
        )


@dataclass(frozen=True)
class Summary:
    """Summary statistics of episodes, each with its interval.

    Attributes
    ----------
    arrival, cost : mean arrival time (over episodes that arrive) and mean cost of each agent.
    success, crash : probability of each agent to arrive, and to crash.
    crash_any : probability that any agent crashes.
    cost_mean : mean cost over agents.
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
    randomize: Randomize | None = None,
    progress: Callable[[int], None] | None = None,
) -> Episodes:
    """Play ``episodes`` of ``game`` under ``rules`` with ``players``, one per agent.

    Episodes draw what ``randomize`` says; agents that are missing cost nothing.

    Groups of episodes with the same seed have independent noise.  ``progress`` is called with the
    number of episodes finished since the last call.

    Raises
    ------
    InputError
        If there is not one player per agent, no episode to play, or a player's actions are of
        another shape or not finite.
    """
    check_players(game, players)
    require(episodes >= 1, "episodes", f"is {episodes}", "ask for at least one")
    parts = []
    for block in range(-(-episodes // COPIES)):
        copies = min(COPIES, episodes - block * COPIES)
        simulator, random = _block(game, rules, copies, seed, group, block, randomize)
        with one_thread():
            parts.append(_play(simulator, players, random))
        if progress is not None:
            progress(copies)
    return Episodes(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def check_players(game: Game, players: Sequence[Player]) -> None:
    """Raise :class:`InputError` unless there is one player per agent."""
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
    """Return (episodes, T + 1, N, n) states of up to ``COPIES`` episodes.

    States are nan after an agent has left.  The episodes are the first that :func:`evaluate` plays.
    """
    require(1 <= episodes <= COPIES, "episodes", f"is {episodes}", f"ask for 1 to {COPIES}")
    simulator, random = _block(game, rules, episodes, seed, group, 0)
    states = [simulator.state.copy()]
    for before, _step in play(simulator, players, _noises(simulator, random)):
        states.append(np.where(before[:, :, None], simulator.state, np.nan))
    return np.stack(states, axis=1)


def _block(
    game: Game,
    rules: Rules | None,
    copies: int,
    seed: int,
    group: int,
    number: int,
    randomize: Randomize | None = None,
) -> tuple[Simulator, np.random.Generator]:
    """Return copies of the game, reset, and the generator of their noise."""
    starts, noise = np.random.SeedSequence(seed, spawn_key=(group, number)).spawn(2)
    simulator = Simulator(game, rules, copies, starts, randomize)
    simulator.reset()
    return simulator, np.random.Generator(np.random.SFC64(noise))


def play(
    simulator: Simulator, players: Sequence[Player], noises: Iterable[np.ndarray]
) -> Iterator[tuple[np.ndarray, Step]]:
    """Play all copies to their ends; yield traffic (C, N) before each step, and the step.

    ``noises`` are the standard normals of successive steps, of ``simulator.noise_shape``.
    """
    C, N, _ = simulator.state.shape
    sizes = [agent.control_dim for agent in simulator.game.agents]
    action = np.zeros((C, N, simulator.action_size))
    for noise in noises:
        traffic = simulator.status == TRAFFIC
        for i, player in enumerate(players):
            if traffic[:, i].any():
                own = player_action(player, simulator.view(i), i, sizes[i])
                action[:, i, : sizes[i]] = own
        yield traffic, simulator.step(action, noise, restart=False)
        # Without restart the kernel would go on moving agents that were truncated: take them out.
        simulator.status[~simulator.alive.any(axis=1)] = CRASHED
        if not simulator.alive.any():
            return


def _noises(simulator: Simulator, random: np.random.Generator) -> Iterator[np.ndarray]:
    C, *rows = simulator.noise_shape
    noise = np.empty((COPIES, *rows))  # drawn whole: more episodes do not change the first ones
    while simulator.alive.any():
        yield random.standard_normal(out=noise)[:C]


def _play(
    simulator: Simulator, players: Sequence[Player], random: np.random.Generator
) -> tuple[np.ndarray, ...]:
    """Play one block to its end; return (C, N) arrival, arrived, crashed, cost."""
    shape = simulator.status.shape
    arrival, cost = np.zeros(shape), np.zeros(shape)
    arrived = simulator.status == ARRIVED  # at time 0: they started at their goals
    crashed = np.zeros(shape, dtype=bool)
    crash_cost = (1 - simulator.lam) * simulator.game.crash_cost
    for _, step in play(simulator, players, _noises(simulator, random)):
        live = np.any(step.acting, axis=1, keepdims=True)
        cost += step.time_cost + (step.crashed & live) * crash_cost
        new_arrivals = step.arrived & live
        arrival[new_arrivals] = np.broadcast_to(simulator.clock[:, None], shape)[new_arrivals]
        arrived |= new_arrivals
        crashed |= step.crashed & live
    return arrival, arrived, crashed, cost


def _share(hits: np.ndarray, confidence: float) -> Estimate:
    return proportion(int(hits.sum()), len(hits), confidence)


def mean_interval(values: np.ndarray, confidence: float = 0.95) -> Interval:
    """Return the mean of independent values with its normal interval."""
    from scipy.stats import norm

    if not values.size:
        return Interval(float("nan"), float("nan"), float("nan"))
    value = float(values.mean())
    half = 0.0
    if values.size > 1:
        half = float(norm.ppf(0.5 + confidence / 2) * values.std(ddof=1) / np.sqrt(values.size))
    return Interval(value, value - half, value + half)
