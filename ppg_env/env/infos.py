"""The infos of the PettingZoo environment: numbers and arrays of the same shape at every step."""

from __future__ import annotations

from collections.abc import Sequence
from operator import or_
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.simulator import Simulator
from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.game.game import Game

Infos = dict[str, dict[str, Any]]

CHOICES = ("numbers", "names")
"""Whether ``crashed_with`` flags the bodies, or lists their names."""


class InfoReader:
    """Reads infos off the first copy of ``simulator``; ``agents`` (N,) are the agents' names.

    With ``names``, crashes list the names of bodies instead of flags.
    """

    def __init__(self, simulator: Simulator, agents: Sequence[str], *, names: bool = False) -> None:
        game = simulator.game
        self._simulator, self._names = simulator, names
        self._index = {name: i for i, name in enumerate(agents)}
        self._regions = [agent.within for agent in game.agents]
        self._bodies = [*agents, *(f"obstacle_{k}" for k in range(len(game.obstacles)))]
        self._met = _bodies_met(game)
        costly = any(agent.effort for agent in game.agents)
        self._no_effort = None if costly else [0.0] * len(agents)
        self._arrived = self._crashed = [False] * len(agents)

    def at_reset(self, playing: Sequence[str]) -> Infos:
        """Return the infos of the agents that are ``playing`` at time 0."""
        zeros = [0.0] * len(self._index)
        self._arrived = (self._simulator.status[0] == ARRIVED).tolist()
        self._crashed = [False] * len(zeros)
        return self._infos(playing, self._no_crash(), zeros, zeros, zeros)

    def after_step(self, acting: Sequence[str]) -> Infos:
        """Return the infos of the agents that were ``acting`` in the last step."""
        # Lists, since operations on arrays of this size would take longer than the kernel.
        last = self._simulator.last
        arrived, crashed = last.arrived[0].tolist(), last.crashed[0].tolist()
        self._arrived = list(map(or_, self._arrived, arrived))
        self._crashed = list(map(or_, self._crashed, crashed))
        time, safety = last.time_cost[0].tolist(), last.safety_cost[0].tolist()
        effort = self._no_effort
        if effort is None:
            lam = self._simulator.lam[0].tolist()
            effort = [max(t - own, 0.0) for t, own in zip(time, lam, strict=True)]
        met = self._crashed_with() if True in crashed else self._no_crash()
        return self._infos(acting, met, time, safety, effort)

    def _infos(
        self,
        acting: Sequence[str],
        crashed_with: np.ndarray,
        time: list[float],
        safety: list[float],
        effort: list[float],
    ) -> Infos:
        arrived, crashed, names, regions = self._arrived, self._crashed, self._names, self._regions
        status, infos = self._simulator.status[0].tolist(), {}
        for name in acting:
            i = self._index[name]
            infos[name] = {
                "arrived": arrived[i],
                "crashed": crashed[i],
                "crashed_with": self._named(crashed_with[i]) if names else crashed_with[i],
                "in_traffic": status[i] == TRAFFIC,
                "outside": bool(regions[i]) and self._outside(i),
                "time_cost": time[i],
                "effort_cost": effort[i],
                "safety_cost": safety[i],
            }
        return infos

    def _outside(self, agent: int) -> bool:
        """Return whether the agent's state is outside its workspace; only means have to stay in."""
        state = self._simulator.bodies[0, agent]
        touch = tol.LENGTH * self._simulator.game.agents[agent].unit
        return any(
            bool(np.any(region.normals @ state[: region.dim] > region.offsets + touch))
            for region in self._regions[agent]
        )

    def _no_crash(self) -> np.ndarray:
        return np.zeros((len(self._index), len(self._bodies)), dtype=np.bool_)

    def _crashed_with(self) -> np.ndarray:
        """Return (N, N + K) whether each agent overlapped each body in the last step."""
        flags, overlap = self._no_crash(), self._simulator.last.overlap[0]
        agents, bodies = (side[overlap] for side in self._met)
        flags[agents, bodies] = True
        both = bodies < len(flags)
        flags[bodies[both], agents[both]] = True
        return flags

    def _named(self, flags: np.ndarray) -> list[str]:
        return [self._bodies[body] for body in np.flatnonzero(flags).tolist()]


def _bodies_met(game: Game) -> tuple[np.ndarray, np.ndarray]:
    """Return (E,) the agent and the other body of each encounter; obstacle k is body N + k."""
    N, K = len(game.agents), len(game.obstacles)
    first, second = np.triu_indices(N, 1)
    agents = np.concatenate([first, np.repeat(np.arange(N), K)])
    return agents, np.concatenate([second, N + np.tile(np.arange(K), N)])
