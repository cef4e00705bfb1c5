r"""Deviations of noisy closed loops from their means, as independent linear processes.

    e_{t+1} = F e_t + w_t,   w_t ~ N(0, noise),   e_0 ~ N(0, sigma0),   F = A - B gain

for every plan, so they are drawn once and added to the means.  Every agent is one process, and
every obstacle that moves with noise: a random walk, F = I.  A body that stays at its goal keeps
the deviation of its arrival, and an obstacle that of the end of its path.

Two agents with equal F that can collide with nothing else are merged into one process, because
only the difference of their deviations matters: it follows the same F with the sum of their
noises, and needs half of the normals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env.game.dynamics import square_root
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_pairs
from ppg_env.risk import kernel
from ppg_env.risk.batches import BLOCK, Scratch


@dataclass(frozen=True, eq=False)
class ErrorProcesses:
    """S processes of n components each, padded with zeros.

    Attributes
    ----------
    loops : (S, n, n) error dynamics F.
    noise, sigma0 : (S, n, n) covariances of a step and of the start.
    rests : (S,) time from which each process stays as it is.
    parties : (E, 2) processes a and b of each encounter, whose displacement deviates by
        e_a - e_b; b = -1 for none.
    dim : number d of position components, the first ones of each process.
    """

    loops: np.ndarray
    noise: np.ndarray
    sigma0: np.ndarray
    rests: np.ndarray
    parties: np.ndarray
    dim: int

    def draw(self, random: np.random.Generator, out: np.ndarray, random_start: bool) -> np.ndarray:
        """Fill ``out`` (T+1, S, n, BLOCK) with a block of deviations at times 0..T, and return it.

        Episodes come last, so that the compiled loops over them use vector instructions.  The
        noise of a step does not depend on T: a longer run continues a shorter one.
        """
        roots, starts = self._roots
        kernel.draw(random, self.loops, roots, starts, random_start, out)
        for s, rest in enumerate(self.rests):
            out[rest + 1 :, s] = out[min(rest, len(out) - 1), s]
        return out

    def scratch(self, steps: int) -> Scratch:
        """Return scratch memory for a block of deviations at times 0..``steps``."""
        return Scratch((steps + 1, *self.loops.shape[:2], BLOCK))

    @cached_property
    def _roots(self) -> list[np.ndarray]:
        return [np.stack([square_root(m) for m in c]) for c in (self.noise, self.sigma0)]

    def covariances(self, steps: int) -> np.ndarray:
        """Return (steps + 1, S, n, n) covariances of each process at times 0..``steps``."""
        result = np.empty((steps + 1, *self.loops.shape))
        result[0] = self.sigma0
        for t in range(steps):
            moved = self.loops @ result[t] @ self.loops.transpose(0, 2, 1) + self.noise
            result[t + 1] = np.where((t < self.rests)[:, None, None], moved, result[t])
        return result


def error_processes(
    game: Game, arrival: Sequence[int | None], *, merge: bool = True
) -> ErrorProcesses:
    """Return the processes of ``game`` for plans with these arrivals.

    ``merge`` two agents into one process where possible.
    """
    agents, d = game.agents, game.dim
    moving = _noisy_obstacles(game)
    n = max(agent.state_dim for agent in agents)
    loops, noise, sigma0 = (np.zeros((len(agents) + len(moving), n, n)) for _ in range(3))
    for i, agent in enumerate(agents):
        k = agent.state_dim
        loops[i, :k, :k] = agent.closed_loop
        noise[i, :k, :k], sigma0[i, :k, :k] = agent.noise, agent.sigma0
    for s, k in enumerate(moving, start=len(agents)):
        loops[s, :d, :d], noise[s, :d, :d] = np.eye(d), game.obstacles[k].noise
    last = agent_rests(game, arrival)
    rests = np.array([*last, *(game.obstacles[k].rest for k in moving)], dtype=np.int64)
    if merge and mergeable(game, arrival):
        total = noise.sum(axis=0)[None], sigma0.sum(axis=0)[None]
        return ErrorProcesses(loops[:1], *total, rests[:1], np.array([[0, -1]]), d)
    parties = encounter_pairs(game)
    for party, encounter in zip(parties, game.encounters, strict=True):
        if encounter.obstacle in moving:
            party[1] = len(agents) + moving.index(encounter.obstacle)
    return ErrorProcesses(loops, noise, sigma0, rests, parties, d)


def mergeable(game: Game, arrival: Sequence[int | None]) -> bool:
    """Return whether there are two agents with equal deviations and no obstacle."""
    if len(game.agents) != 2 or game.obstacles:
        return False
    first, second = (agent.closed_loop for agent in game.agents)
    rests = agent_rests(game, arrival)
    return np.array_equal(first, second) and rests[0] == rests[1]


def agent_rests(game: Game, arrival: Sequence[int | None]) -> list[int]:
    """Return the time from which each agent's errors stay as they are, H if that is never."""
    stay, H = game.on_goal == "stay", game.horizon
    return [min(t, H) if stay and t is not None else H for t in arrival]


def _noisy_obstacles(game: Game) -> list[int]:
    """Return the obstacles whose positions are uncertain."""
    return [k for k, o in enumerate(game.obstacles) if o.rest and o.noise.any()]
