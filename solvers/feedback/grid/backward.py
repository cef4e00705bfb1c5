"""Dynamic programming backwards in time, for any way of choosing actions at a stage.

A stage starts from the expected costs to go after its noise, per joint grid state.  The fields are
these costs before the noise, for both agents in traffic after it or one of them:

    C_i = E[V_i; both in traffic] + E[V_i alone; i in traffic, the other has arrived].

Where bodies stay, the second term is what both cost while one is parked
(:mod:`solvers.feedback.grid.parking`).

A :class:`Chooser` selects actions and returns the costs of the stage.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic
from typing import Protocol

import numpy as np

from ppg_env.errors import InputError
from solvers.feedback.grid.joint_model import FLOAT, JointModel
from solvers.feedback.grid.parking import Parking, interpolated
from solvers.feedback.grid.places import make_places
from solvers.feedback.grid.state_grid import Grid, padded

STATIONARY = 1e-4
"""A stage that changes no cost by more than this, and all before it, count as the same."""

SPARE = 36
"""Arrays over the joint grid that are in use at the same time, without the stages."""


class Chooser(Protocol):
    """Chooses actions at a stage."""

    agents: tuple[int, ...]
    together: bool
    kept: int

    @property
    def stationary(self) -> bool:
        """Whether all stages before the latest one have the same game."""
        ...

    def choose(
        self, clock: int, fields: list[np.ndarray], ahead: dict[int, np.ndarray]
    ) -> tuple[list[np.ndarray], np.ndarray]:
        """Return costs (K0, K1) of each of ``agents``, and actions (F, K0, K1).

        ``fields`` are those of ``agents``, ``ahead`` (K,) their costs after a move when alone.
        """
        ...

    def parked_ends(self, clock: int, places: dict[int, Grid]) -> dict[int, np.ndarray]:
        """Return the ends (P, K, 2) of moves that are given, past an agent parked at ``places``."""
        ...

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return the fields (F, K0, K1) that a player needs."""
        ...


@dataclass(frozen=True)
class Stages:
    """The stages of a solution, by the number of steps left: row 0 is the last step.

    Attributes
    ----------
    fields : (S, F, K0, K1) float32 costs after both moves.
    choice : (S, F, K0, K1) numbers of the actions.
    alone : per agent that is solved for, (S, K) costs after its move when it is alone.
    passing : per such agent, (S, K0, P) or (S, P, K1) what it minimises after its move while the
        other agent is parked at one of P places; empty unless bodies stay.
    start : per such agent, its expected cost from the starts of both.
    stationary : whether the last row stands for all earlier stages.
    change : largest change of a cost in the last stage.
    """

    fields: np.ndarray
    choice: np.ndarray
    alone: dict[int, np.ndarray]
    passing: dict[int, np.ndarray]
    start: dict[int, float]
    stationary: bool
    change: float


def memory(model: JointModel, chooser: Chooser) -> int:
    """Return the bytes that :func:`solve_backward` needs at most."""
    states = model.shape[0] * model.shape[1]
    stages = model.rules.steps(model.game)
    per_stage = FLOAT * chooser.kept + len(chooser.agents) * (1 if model.most_actions <= 256 else 2)
    passing = 0
    if model.risk.parks:
        passing = sum(len(make_places(model, 1 - i).index) * model.shape[i] for i in range(2))
    moves = sum(part.nbytes for i in range(2) for part in vars(model.moves(i, 0)).values())
    both = states * (stages * per_stage + SPARE * FLOAT)
    return both + passing * (stages + SPARE) * FLOAT + moves


def solve_backward(
    model: JointModel,
    chooser: Chooser,
    memory_limit: float,
    time_limit: float | None,
    progress: Callable[[int, int], None] | None,
) -> Stages:
    """Return all stages, or those up to a stationary one.

    Raises
    ------
    InputError
        If more memory would be needed than ``memory_limit`` bytes, or time runs out.
    """
    check_memory(memory(model, chooser), memory_limit)
    start, total = monotonic(), model.rules.steps(model.game)
    values = [np.zeros(model.shape, dtype=np.float32) for _ in chooser.agents]
    alone = {i: np.zeros(model.grids[i].size, dtype=np.float32) for i in chooser.agents}
    record, parking = _Record(model, chooser, total), None
    if model.risk.parks:
        parking = Parking(model, chooser.agents, together=chooser.together)
    for done, clock in enumerate(reversed(range(total)), 1):
        ahead = {i: model.filters[i].traffic(alone[i]) for i in chooser.agents}
        past = {} if parking is None else parking.ahead()
        fields = [
            _continue(model, i, value, ahead[i], parking.arrivals(i, past) if parking else None)
            for i, value in zip(chooser.agents, values, strict=True)
        ]
        values, choice = chooser.choose(clock, fields, ahead)
        alone = {
            i: model.alone(i, clock, ahead[i]).min(axis=1) + np.float32(model.lam[i])
            for i in chooser.agents
        }
        kept: dict[int, np.ndarray] = {}
        if parking is not None:
            kept = parking.kept(past)
            sides = {i: model.side(i, clock, ahead[i]) for i in chooser.agents}
            parking.step(sides, past, chooser.parked_ends(clock, parking.places))
        change = record.add(chooser.keep(fields), choice, ahead, kept)
        if progress is not None:
            progress(done, total)
        if change < STATIONARY and chooser.stationary and model.clock_free:
            break
        check_time(start, time_limit, done, total)
    after = dict(zip(chooser.agents, values, strict=True))
    return record.stages({i: _at_start(model, i, after[i], alone[i], parking) for i in after})


class _Record:
    """The stages so far; pages of memory are used as they are filled."""

    def __init__(self, model: JointModel, chooser: Chooser, total: int) -> None:
        self._agents, self._done, self._change = chooser.agents, 0, np.inf
        kind = np.uint8 if model.most_actions <= 256 else np.uint16
        self._passing: list[dict[int, np.ndarray]] = []
        self._fields = np.empty((total, chooser.kept, *model.shape), np.float32)
        self._choice = np.empty((total, len(chooser.agents), *model.shape), kind)
        self._alone = {i: np.empty((total, model.grids[i].size), np.float32) for i in self._agents}

    def add(
        self,
        fields: np.ndarray,
        choice: np.ndarray,
        ahead: dict[int, np.ndarray],
        passing: dict[int, np.ndarray],
    ) -> float:
        """Store a stage; return the largest difference of its fields from the stage before."""
        k = self._done
        self._fields[k], self._choice[k] = fields, choice
        for i in self._agents:
            self._alone[i][k] = ahead[i]
        self._passing.append(passing)
        if k:
            self._change = float(np.abs(fields - self._fields[k - 1]).max())
        self._done += 1
        return self._change

    def stages(self, start: dict[int, float]) -> Stages:
        """Return the stages; ``start`` are the costs from the starts."""
        kept = slice(self._done)
        return Stages(
            self._fields[kept],
            self._choice[kept],
            {i: alone[kept] for i, alone in self._alone.items()},
            {i: np.stack([stage[i] for stage in self._passing]) for i in self._passing[0]},
            start,
            self._done < len(self._fields),
            self._change,
        )


def _continue(
    model: JointModel, agent: int, values: np.ndarray, ahead: np.ndarray, past: np.ndarray | None
) -> np.ndarray:
    """Return the field (K0, K1) of ``agent`` from the costs ``values`` after the noise.

    ``past`` is what it expects after an arrival, if bodies stay.
    """
    first, second = model.filters
    field = first.traffic(values, values.shape[1])
    field = second.traffic(field)
    if past is not None:
        field += past
    elif agent == 0:
        field += ahead[:, None] * (1.0 - second.stays)[None]
    else:
        field += (1.0 - first.stays)[:, None] * ahead[None]
    return field


def _at_start(
    model: JointModel, agent: int, values: np.ndarray, alone: np.ndarray, parking: Parking | None
) -> float:
    """Return the cost of ``agent`` from the starts; agents that start at their goals have arrived.

    ``values`` (K0, K1) are its costs with both in traffic, and ``alone`` (K,) without the other.
    """
    movers = model.game.agents
    starts = [padded(mover.start) for mover in movers]
    there = [i for i, m in enumerate(movers) if np.array_equal(m.start[: m.goal.size], m.goal)]
    if not there:
        rows = interpolated(values, model.grids[1], starts[1])
        return float(interpolated(rows, model.grids[0], starts[0]))
    if len(there) == 2 or (parking is None and agent in there):
        return 0.0
    if parking is not None:
        return parking.at(agent, there[0], starts)
    return float(interpolated(alone, model.grids[agent], starts[agent]))


def check_time(start: float, limit: float | None, done: int, total: int) -> None:
    """Refuse to go on where ``limit`` seconds have passed since ``start`` and stages are left."""
    if limit is not None and monotonic() - start > limit and done < total:
        raise InputError(
            "time_limit",
            f"of {limit:g} s ended after {done} of {total} stages",
            "allow more time, or a larger step",
        )


def check_memory(needed: int, limit: float) -> None:
    """Refuse what needs more than ``limit`` bytes."""
    if needed > limit:
        raise InputError(
            "memory_limit",
            f"is {limit / 1e9:.3g} GB where {needed / 1e9:.3g} GB are needed",
            "allow more, or give a larger step",
        )
