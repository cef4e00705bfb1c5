r"""Deviations of noisy closed loops from their means, as independent linear processes.

    e_{t+1} = F e_t + w_t,   w_t ~ N(0, noise),   e_0 ~ N(0, sigma0),   F = A - B gain

for every plan, so they are drawn once and added to the means.  Every agent is one process.  Two
agents with equal F that can collide with nothing else are merged into one process, because only
the difference of their deviations matters: it follows the same F with the sum of their noises,
and needs half of the normals.
"""

from __future__ import annotations

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
    parties : (E, 2) processes a and b of each encounter, whose displacement deviates by
        e_a - e_b; b = -1 for none.
    dim : number d of position components, the first ones of each process.
    """

    loops: np.ndarray
    noise: np.ndarray
    sigma0: np.ndarray
    parties: np.ndarray
    dim: int

    def draw(self, random: np.random.Generator, out: np.ndarray, random_start: bool) -> np.ndarray:
        """Fill ``out`` (T+1, S, n, BLOCK) with a block of deviations at times 0..T, and return it.

        Episodes come last, so that the compiled loops over them use vector instructions.  The
        noise of a step does not depend on T: a longer run continues a shorter one.
        """
        roots, starts = self._roots
        kernel.draw(random, self.loops, roots, starts, random_start, out)
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
            result[t + 1] = self.loops @ result[t] @ self.loops.transpose(0, 2, 1) + self.noise
        return result


def error_processes(game: Game, *, merge: bool = True) -> ErrorProcesses:
    """Return the processes of ``game``; ``merge`` two agents into one process where possible."""
    agents, n = game.agents, max(agent.state_dim for agent in game.agents)
    loops, noise, sigma0 = (np.zeros((len(agents), n, n)) for _ in range(3))
    for i, agent in enumerate(agents):
        k = agent.state_dim
        loops[i, :k, :k] = agent.closed_loop
        noise[i, :k, :k], sigma0[i, :k, :k] = agent.noise, agent.sigma0
    if merge and mergeable(game):
        parties, total = np.array([[0, -1]]), (noise.sum(axis=0), sigma0.sum(axis=0))
        return ErrorProcesses(loops[:1], total[0][None], total[1][None], parties, game.dim)
    return ErrorProcesses(loops, noise, sigma0, encounter_pairs(game), game.dim)


def mergeable(game: Game) -> bool:
    """Return whether there are two agents with equal error dynamics and no obstacle."""
    if len(game.agents) != 2 or game.obstacles:
        return False
    first, second = (agent.closed_loop for agent in game.agents)
    return np.array_equal(first, second)
