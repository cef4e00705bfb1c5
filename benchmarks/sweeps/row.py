"""A row of a sweep: a cell and its result.

Infinite and undefined numbers are None, as in JSON, so that a row is the same before and after it
is stored.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from benchmarks.sweeps.cell import Cell
from ppg_env.formats.game_file import game_to_tables
from ppg_env.formats.plan_file import to_json
from ppg_env.game.input_sets import pieces

FAILED = "failed"
"""Status of a cell that ended in an error."""

Numbers = list[float | None]
Counts = list[int | None]
Words = list[str]
Estimates = list[dict[str, float]]
"""Each with ``value``, ``low`` and ``high``."""

Table = dict[str, Any]
GameTables = dict[str, Any]
Paths = list[list[list[float]]]

PACKED = ("GameTables", "Paths")
"""Types of large columns, which are stored compressed."""


@dataclass(frozen=True)
class Row:
    """One cell and its result; the columns of the store, in this order.

    Lists have one entry per agent, unless stated otherwise.

    Attributes
    ----------
    address : address of the cell.
    scenario : the game's name; the stem of its file if it has none.
    lam, gain, noise, speed : the value common to all agents (k for a matrix k I; for speed, the
        kind of the control sets); None if they differ.
    lams : lam of each agent.
    fields : the overridden fields of the game.
    game : the whole game, as in a game file.
    start, order, charge, ... node_limit : options of the cell; None for those without effect.
    status : status of the planner, ``trained`` for learners, ``failed`` after an error.
    reason : why there is no result, with advice; None if there is one.
    arrival, cost, shifted_cost, safety_cost, deficit, risk_bound : of the plans, by the evaluator.
    social_cost, potential, risk_bound_any, complaints : the same for all agents together.
    minimised, value, bound, gap, regret, updates : certificates, as in ``ppg solve``.
    information, runs, played_arrival, arrival_mean, success : as in ``ppg compare``.
    crash_probability, crash_probability_low, crash_probability_high : of any agent, with limits.
    crash_probability_agents : of each agent.
    crash_method : the estimator of these, ``mc`` or ``rare``.
    expected_cost, expected_cost_low, expected_cost_high : mean over agents, with limits.
    over_runs : limits over training runs.
    group_costs, group_crashes : in ``env``, per group of episodes, not per agent.
    play_regret : gain of each agent by the ``deviation`` of the cell; of run 0, for learners.
    means, controls : of the plans, (N, H+1, n) and (N, H, m).
    seconds : wall time, the only entry that the cell does not determine.
    """

    address: str
    scenario: str
    player: str
    agents: int
    objective: str
    lam: float | None
    gain: float | None
    noise: float | None
    speed: str | None
    horizon: int
    margin_cap: float
    crash_cost: float
    scale: str
    collisions: str
    on_goal: str
    lams: Numbers
    fields: Table
    game: GameTables
    start: str | None
    order: str | None
    charge: str | None
    arena: str
    episodes: int
    groups: int | None
    deviation: str | None
    seed: int
    solver: str
    time_limit: float | None
    node_limit: int | None
    status: str
    reason: str | None = None
    arrival: Counts | None = None
    cost: Numbers | None = None
    shifted_cost: Numbers | None = None
    safety_cost: Numbers | None = None
    deficit: Numbers | None = None
    risk_bound: Numbers | None = None
    social_cost: float | None = None
    potential: float | None = None
    risk_bound_any: float | None = None
    complaints: Words | None = None
    minimised: str | None = None
    value: float | None = None
    bound: float | None = None
    gap: float | None = None
    regret: Numbers | None = None
    updates: int | None = None
    information: str | None = None
    runs: int | None = None
    played_arrival: Numbers | None = None
    arrival_mean: float | None = None
    success: Estimates | None = None
    crash_probability: float | None = None
    crash_probability_low: float | None = None
    crash_probability_high: float | None = None
    crash_probability_agents: Estimates | None = None
    crash_method: str | None = None
    expected_cost: float | None = None
    expected_cost_low: float | None = None
    expected_cost_high: float | None = None
    over_runs: Table | None = None
    group_costs: Numbers | None = None
    group_crashes: Numbers | None = None
    play_regret: Estimates | None = None
    means: Paths | None = None
    controls: Paths | None = None
    seconds: float = 0.0

    @property
    def failed(self) -> bool:
        """Whether there is no result."""
        return self.reason is not None


COLUMNS: dict[str, str] = {
    item.name: str(item.type).removesuffix(" | None") for item in fields(Row)
}
"""Name and type of every column."""


def make_row(cell: Cell, report: Mapping[str, Any]) -> Row:
    """Return the row of ``cell``; entries of ``report`` that are no columns are ignored."""
    flat: dict[str, Any] = {}
    for name, value in json.loads(to_json(report)).items():
        if isinstance(value, dict) and set(value) == {"value", "low", "high"}:
            flat |= {name: value["value"], f"{name}_low": value["low"]}
            flat[f"{name}_high"] = value["high"]
        else:
            flat[name] = value
    asked = _asked(cell)
    result = {name: flat[name] for name in COLUMNS if name in flat and name not in asked}
    return Row(**asked, **result)


def _asked(cell: Cell) -> dict[str, Any]:
    """Return the columns that the cell determines."""
    game = cell.game
    agents = game.agents
    return {
        "address": cell.address,
        "scenario": game.name or cell.scenario.rpartition("/")[2].removesuffix(".toml"),
        "player": cell.player,
        "agents": len(agents),
        "objective": game.objective,
        "lam": _common(agent.lam for agent in agents),
        "gain": _common(_multiple(agent.gain) for agent in agents),
        "noise": _common(_multiple(agent.noise) for agent in agents),
        "speed": _common(piece.kind for agent in agents for _, piece in pieces(agent.control)),
        "horizon": game.horizon,
        "margin_cap": game.margin_cap,
        "crash_cost": game.crash_cost,
        "scale": game.scale,
        "collisions": game.collisions,
        "on_goal": game.on_goal,
        "lams": [agent.lam for agent in agents],
        "fields": json.loads(json.dumps(cell.fields, default=_written)),
        "game": game_to_tables(game),
        **cell.effective_options,
    }


def _common(values: Iterable[Any]) -> Any:
    """Return the common value of ``values``, or None."""
    first, *others = values
    return first if all(other == first for other in others) else None


def _multiple(matrix: np.ndarray) -> float | None:
    """Return the number k of a ``matrix`` k I; None for any other matrix."""
    k = float(matrix[0, 0])
    return k if np.array_equal(matrix, k * np.eye(*matrix.shape)) else None


def _written(value: Any) -> Any:
    """Return a form of arrays and polytopes that JSON can hold."""
    return value.tolist() if isinstance(value, np.ndarray) else repr(value)
