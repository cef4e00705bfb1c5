"""The infos of the PettingZoo environment, and the names of the bodies that agents crash with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.simulator import Simulator
from ppg_env.env.status import TRAFFIC
from ppg_env.game.game import Game

Infos = dict[str, dict[str, Any]]


class InfoReader:
    """Reads infos off the first copy of ``simulator``; ``names`` (N,) are those of the agents."""

    def __init__(self, simulator: Simulator, names: Sequence[str]) -> None:
        self._simulator = simulator
        self._index = {name: i for i, name in enumerate(names)}
        self._regions = [agent.within for agent in simulator.game.agents]
        self._partners = _partners(simulator.game, names)

    def at_reset(self) -> Infos:
        """Return the infos of all agents at time 0."""
        traffic = (self._simulator.status[0] == TRAFFIC).tolist()
        costs = {"crashed": False, "time_cost": 0.0, "safety_cost": 0.0}
        return {
            name: costs
            | {
                "crashed_with": [],
                "arrived": not traffic[i],
                "in_traffic": traffic[i],
                "outside": self._outside(i),
            }
            for name, i in self._index.items()
        }

    def after_step(self, acting: Sequence[str]) -> Infos:
        """Return the infos of the agents that were ``acting`` in the last step."""
        last, index, regions = self._simulator.last, self._index, self._regions
        arrived, crashed = last.arrived[0].tolist(), last.crashed[0].tolist()
        time, safety = last.time_cost[0].tolist(), last.safety_cost[0].tolist()
        traffic = (self._simulator.status[0] == TRAFFIC).tolist()
        infos = {}
        for name in acting:
            i = index[name]
            infos[name] = {
                "arrived": arrived[i],
                "crashed": crashed[i],
                "crashed_with": self._crashed_with(i) if crashed[i] else [],
                "in_traffic": traffic[i],
                "outside": bool(regions[i]) and self._outside(i),
                "time_cost": time[i],
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

    def _crashed_with(self, agent: int) -> list[str]:
        overlap = self._simulator.last.overlap[0]
        return [name for e, name in self._partners[agent] if overlap[e]]


def _partners(game: Game, names: Sequence[str]) -> list[list[tuple[int, str]]]:
    """Return, for each agent, the encounters it is in and the name of the other body."""
    partners: list[list[tuple[int, str]]] = [[] for _ in names]
    for e, encounter in enumerate(game.encounters):
        if encounter.obstacle is not None:
            partners[encounter.agents[0]].append((e, f"obstacle_{encounter.obstacle}"))
            continue
        i, j = encounter.agents
        partners[i].append((e, names[j]))
        partners[j].append((e, names[i]))
    return partners
