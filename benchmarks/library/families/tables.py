"""Tables of agents, obstacles and games, as in a game file, from few numbers.

Names of games are unique and describe what varies; lengths of robots are in m, and a step is 1 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Table = dict[str, Any]

Draft = tuple[str, Table]
"""The name of a game and the tables of its file."""

DRIFT = [[1, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]]
PUSH = [[0.5, 0], [0, 0.5], [1, 0], [0, 1]]
FEEDBACK = [[0.2, 0, 0.6, 0], [0, 0.2, 0, 0.6]]


def walker(start: Sequence[float], goal: Sequence[float], **fields: Any) -> Table:
    """Return a single integrator with a body of side 0.6 and speeds up to 1 per axis."""
    table: Table = {"start": list(start), "goal": list(goal), "lam": 0.6, "gain": 0.5}
    table |= {"noise": 0.0004, "shape": {"box": [0.6] * len(start)}}
    return table | {"control": {"box": [1.0] * len(start)}} | fields


def robot(
    start: Sequence[float],
    goal: Sequence[float],
    low: Sequence[float],
    high: Sequence[float],
    *,
    noise: float = 0.0004,
    top: float = 1.0,
    push: float = 0.5,
    **fields: Any,
) -> Table:
    """Return a double integrator in a workspace, at rest at both ends, with limited speeds."""
    return {
        "start": [*start, 0, 0],
        "goal": [*goal, 0, 0],
        "lam": 0.6,
        "A": DRIFT,
        "B": PUSH,
        "gain": FEEDBACK,
        "noise": [[noise, 0, 0, 0], [0, noise, 0, 0], [0, 0, noise / 4, 0], [0, 0, 0, noise / 4]],
        "shape": {"box": [0.6, 0.6]},
        "control": {"box": [push, push]},
        "within": {"low": [*low, -top, -top], "high": [*high, top, top]},
    } | fields


def wall(left: float, below: float, right: float, above: float) -> Table:
    """Return a rectangle at rest."""
    corners = [[left, below], [right, below], [right, above], [left, above]]
    return {"vertices": [[round(x, 6), round(y, 6)] for x, y in corners]}


def game(
    horizon: int,
    agents: Sequence[Table],
    obstacles: Sequence[Table] = (),
    *,
    objective: str = "risk",
    collisions: str = "swept",
    on_goal: str = "remove",
    **fields: Any,
) -> Table:
    """Return the tables of a game with every rule written out."""
    head = {"horizon": horizon, "objective": objective, "crash_cost": 100.0}
    head["margin_cap"] = 5.0 if objective == "risk" else 3.0
    head |= {"collisions": collisions, "on_goal": on_goal} | fields
    return {"game": head, "agent": list(agents), "obstacle": list(obstacles)}


def scenario_tables(scenario: str, **overrides: Any) -> Table:
    """Return the tables of a scenario of the package, with multiples of the identity as numbers."""
    from ppg_env.formats.game_file import game_to_tables
    from ppg_env.scenarios.make import make_game

    tables = game_to_tables(make_game(scenario, **overrides))
    for key in ("name", "scale"):
        tables["game"].pop(key, None)
    for agent in tables["agent"]:
        for key in ("gain", "noise"):
            agent[key] = _number(agent[key])
    return tables


def _number(matrix: list[list[float]]) -> float | list[list[float]]:
    first, size = matrix[0][0], range(len(matrix))
    same = all(matrix[i][j] == (first if i == j else 0) for i in size for j in size)
    return first if same else matrix
