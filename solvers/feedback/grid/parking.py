"""Costs while one agent is parked at its goal and the other one moves, for ``on_goal="stay"``.

While agent i moves and agent j is parked, i pays for time and crashes, and j for crashes.  Both
costs are functions of the state of i and of the place of j, a point of j's grid in or next to its
arrival region.  Arrays over them are (P, K): P places, K states of i.
"""

from __future__ import annotations

import numpy as np

from solvers.feedback.grid.event_table import chances_of
from solvers.feedback.grid.joint_model import JointModel
from solvers.feedback.grid.moves import stencils
from solvers.feedback.grid.places import make_places
from solvers.feedback.grid.response_kernels import respond
from solvers.feedback.grid.stage_kernels import Side, reach_of
from solvers.feedback.grid.state_grid import AXES, Grid

Both = tuple[np.ndarray, np.ndarray]
"""Costs (P, K) of the mover and of the parked agent."""


class Passing:
    """Costs while agent ``mover`` moves and the other one is parked, stage by stage.

    Attributes
    ----------
    places : of the parked agent.
    own, other : (P, K) costs to go of the mover and of the parked agent, after the noise.
    """

    def __init__(self, model: JointModel, mover: int, *, together: bool) -> None:
        self._model, self._mover, self._together = model, mover, together
        self.places = make_places(model, 1 - mover)
        shape = len(self.places.index), model.grids[mover].size
        self.own, self.other = np.zeros(shape, np.float32), np.zeros(shape, np.float32)

    def ahead(self) -> Both:
        """Return both costs before the noise of the mover."""
        noise = self._model.filters[self._mover]
        return noise.traffic(self.own), noise.traffic(self.other)

    def objective(self, ahead: Both) -> np.ndarray:
        """Return what the mover minimises: its own cost, or the sum where both act together."""
        return ahead[0] + ahead[1] if self._together else ahead[0]

    def step(self, side: Side, ahead: Both) -> None:
        """Go back one stage in which the mover acts best."""
        model, mover, grid = self._model, self._mover, self.places.grid
        field = self.objective(ahead)
        cost = float(model.crash.sum() if self._together else model.crash[mover])
        out, best = np.empty_like(field), np.empty(field.shape, np.int32)
        ends = np.ascontiguousarray(grid.points[:, None], dtype=np.float32)
        respond(
            field, side, model.risk, mover == 0, cost, float(model.lam[mover]), reach_of(side),
            grid.low, grid.step, grid.shape, grid.points, ends, model.stays(mover),
            np.zeros(grid.size, np.float32), out, best,
        )  # fmt: skip
        points = np.arange(field.shape[1])[None]
        index, weight = side.index[points, best], side.weight[points, best]
        chance = self._chance(side.points[points], side.ends[points, best])
        chance *= side.stays[points, best]
        effort = side.cost[points, best] + model.lam[mover]
        self._settle(_read(ahead[0], index, weight), _read(ahead[1], index, weight), chance, effort)

    def follow(self, ends: np.ndarray, ahead: Both) -> None:
        """Go back one stage in which the mover goes to ``ends`` (P, K, 2); its cost is left out."""
        model, mover = self._model, self._mover
        grid = model.grids[mover]
        index, weight = stencils(grid, ends.reshape(-1, AXES).astype(float))
        index, weight = (part.reshape(*ends.shape[:2], -1) for part in (index, weight))
        chance = self._chance(grid.points[None], ends)
        chance *= (model.stays(mover)[index] * weight).sum(axis=2)
        none = np.zeros_like(ahead[1])
        self._settle(none, _read(ahead[1], index, weight), chance, none)

    def _chance(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return (P, K) the probability of an overlap in the moves of the mover."""
        sign = 1.0 if self._mover == 0 else -1.0
        place = self.places.grid.points[:, None]
        apart = [
            np.ascontiguousarray(np.broadcast_to(sign * (states - place), after.shape))
            for states in (before, after.astype(float))
        ]
        flat = [values.reshape(-1, AXES) for values in apart]
        return chances_of(self._model.risk, *flat).reshape(after.shape[:2])

    def _settle(
        self, own: np.ndarray, other: np.ndarray, chance: np.ndarray, effort: np.ndarray
    ) -> None:
        crash, removes = self._model.crash, self._model.risk.removes
        own = own + chance * (crash[self._mover] - own * removes) + effort
        other = other + chance * (crash[1 - self._mover] - other * removes)
        self.own, self.other = own.astype(np.float32), other.astype(np.float32)


def _read(values: np.ndarray, index: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return (P, K) ``values`` (P, K) at the stencils (P, K, S) of states after a move."""
    places = np.arange(len(values))[:, None, None]
    return (values[places, index] * weight).sum(axis=2)


class Parking:
    """Costs of both agents while the other one is parked.

    ``agents`` are those that are solved for; the moves of others are arguments of :meth:`step`.
    """

    def __init__(self, model: JointModel, agents: tuple[int, ...], *, together: bool) -> None:
        self._model, self._agents = model, agents
        self.passing = {i: Passing(model, i, together=together) for i in range(2)}

    @property
    def places(self) -> dict[int, Grid]:
        """Per mover, the places of the other agent."""
        return {i: passing.places.grid for i, passing in self.passing.items()}

    def ahead(self) -> dict[int, Both]:
        """Return the costs before the noise, per mover."""
        return {i: passing.ahead() for i, passing in self.passing.items()}

    def arrivals(self, agent: int, ahead: dict[int, Both]) -> np.ndarray:
        """Return (K0, K1) what ``agent`` expects if one of both arrives in the step."""
        other, shape, filters = 1 - agent, self._model.shape, self._model.filters
        own = self.passing[agent].places.spread(ahead[agent][0], shape[other])
        own = filters[other].arrives(own, shape[agent])
        hit = self.passing[other].places.spread(ahead[other][1], shape[agent])
        hit = filters[agent].arrives(hit, shape[other])
        return own.T + hit if agent == 0 else own + hit.T

    def step(
        self, sides: dict[int, Side], ahead: dict[int, Both], ends: dict[int, np.ndarray]
    ) -> None:
        """Go back one stage; ``ends`` (P, K, 2) are those of movers that are not solved for."""
        for i, passing in self.passing.items():
            if i in self._agents:
                passing.step(sides[i], ahead[i])
            else:
                passing.follow(ends[i], ahead[i])

    def kept(self, ahead: dict[int, Both]) -> dict[int, np.ndarray]:
        """Return the fields that players need, (K0, P) of agent 0 and (P, K1) of agent 1."""
        fields = {i: self.passing[i].objective(ahead[i]) for i in self._agents}
        return {i: np.ascontiguousarray(f.T) if i == 0 else f for i, f in fields.items()}

    def at(self, agent: int, parked: int, starts: list[np.ndarray]) -> float:
        """Return the cost of ``agent`` at the states ``starts`` (2,) with ``parked`` at rest."""
        mover = 1 - parked
        passing = self.passing[mover]
        values = passing.other if agent == parked else passing.own
        rows, columns = passing.places.grid, self._model.grids[mover]
        return float(interpolated(interpolated(values, columns, starts[mover]), rows,
                                  starts[parked]))  # fmt: skip


def interpolated(values: np.ndarray, grid: Grid, state: np.ndarray) -> np.ndarray:
    """Return ``values`` (..., K) of grid points at ``state`` (2,)."""
    index, weight = stencils(grid, state[None])
    return np.asarray(values[..., index[0]] @ weight[0])
