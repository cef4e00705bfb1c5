"""The data of the report's explorer: games, plans and their numbers.

The data hold what is drawn: outlines of bodies and obstacles, the means of the plans up to each
agent's arrival, and the numbers of the cell.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from benchmarks.reproduction.curves import Panel
from benchmarks.reproduction.extent import BEST_RESPONSE, EQUILIBRIA, SOCIAL, Place
from benchmarks.reproduction.run import Reproduction
from benchmarks.sweeps import Row
from ppg_env.formats.game_file import game_from_tables
from ppg_env.game.game import Game
from ppg_env.plotting.bodies import COLOURS, outline, plane

DECIMALS = 3
"""Decimals of coordinates: a thousandth of a length is far below the resolution of a screen."""

DIGITS = 6
"""Significant digits of all other numbers."""

BORDER = 4.0
"""Width of the free border around the drawing, a length."""

Points = list[list[float]]


def explorer_data(reproduction: Reproduction) -> dict[str, Any]:
    """Return the explorer's data, ready for JSON: numbers, text, lists and dictionaries.

    ``panels`` has one entry per panel; its ``plans`` have one list per solution, with one entry
    for each of ``lams``.  ``start`` is the first selection.
    """
    return {
        "colours": COLOURS,
        "lams": list(reproduction.extent.lams),
        "equilibria": EQUILIBRIA,
        "social": SOCIAL,
        "event": reproduction.extent.crash_event,
        "start": _start(reproduction.panels.values()),
        "panels": [_panel(panel) for panel in reproduction.panels.values()],
    }


def _start(panels: Iterable[Panel]) -> dict[str, Any]:
    """Return the first selection: where the paper's equilibrium loses most safety."""
    gaps = [(panel, np.nan_to_num(panel.mean_gap(BEST_RESPONSE, "safety"))) for panel in panels]
    panel, gap = max(gaps, key=lambda pair: float(pair[1].max()))
    return {**_names(panel.place), "equilibrium": BEST_RESPONSE, "lam": int(gap.argmax())}


def _names(place: Place) -> dict[str, str]:
    return {
        "setting": str(place.setting),
        "scenario": place.scenario,
        "gain": f"{place.gain:g}",
    }


def _panel(panel: Panel) -> dict[str, Any]:
    place = panel.place
    # The games of a panel differ in lam only, which is not drawn.
    game = game_from_tables(panel.plans[SOCIAL][0].game, place.scenario)
    plans = {name: [_plan(row, game) for row in rows] for name, rows in panel.plans.items()}
    return {
        **_names(place),
        "bodies": [_points(outline(agent.shape.vertices)) for agent in game.agents],
        "goals": [_place(agent.goal[: game.dim]) for agent in game.agents],
        "obstacles": [_points(outline(obstacle.vertices_at(0))) for obstacle in game.obstacles],
        "view": _view(game, [plan for some in plans.values() for plan in some]),
        "plans": plans,
    }


def _plan(row: Row, game: Game) -> dict[str, Any]:
    """Return the numbers of a cell, and the means of each agent from start to arrival."""
    if row.means is None or row.arrival is None:
        return {"status": row.status, "reason": row.reason or "there is no plan"}
    return {
        "status": row.status,
        "arrival": row.arrival,
        "objective": _rounded(row.shifted_cost),
        "safety": _rounded(row.deficit),
        "regret": _rounded(row.regret),
        "crash": _rounded(
            (row.crash_probability, row.crash_probability_low, row.crash_probability_high)
        ),
        "riskBound": _rounded((row.risk_bound_any,)),
        "paths": [
            _points(np.array(means)[: None if last is None else last + 1, : game.dim])
            for means, last in zip(row.means, row.arrival, strict=True)
        ],
    }


def _view(game: Game, plans: Sequence[dict[str, Any]]) -> list[float]:
    """Return left, bottom, width and height of the area that all plans of a panel cover.

    The view is that of the whole panel, so that it stays the same for all lam.
    """
    corners = [outline(obstacle.vertices_at(0)) for obstacle in game.obstacles]
    for i, agent in enumerate(game.agents):
        body = outline(agent.shape.vertices)
        reached = [path for plan in plans if "paths" in plan for path in plan["paths"][i]]
        places = [_place(agent.start[: game.dim]), _place(agent.goal[: game.dim]), *reached]
        corners += [np.array(places)[:, None] + extreme for extreme in (body.min(0), body.max(0))]
    points = np.concatenate([some.reshape(-1, 2) for some in corners])
    low, high = points.min(axis=0) - BORDER, points.max(axis=0) + BORDER
    return [round(float(value), DECIMALS) for value in (*low, *(high - low))]


def _points(points: np.ndarray) -> Points:
    """Return points (P, d) as a list of x and y."""
    return [_place(point) for point in points]


def _place(point: np.ndarray) -> list[float]:
    return [round(float(value), DECIMALS) for value in plane(point)]


def _rounded(values: Iterable[float | None] | None) -> list[float | None]:
    return [
        None if value is None else float(f"{value:.{DIGITS}g}")
        for value in (() if values is None else values)
    ]
