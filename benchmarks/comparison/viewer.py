"""A plan as one page that moves: play, pause, set the time, point at a body or at a dot.

``viewer.html`` is the template and ``viewer.js`` the script.  The page loads nothing: all
data are in it, and names are text.  The clearance of two bodies at displacement z is

    max_p (a_p' z - b_p)

over the faces of their collision set: no more than their distance, and negative where they overlap.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from benchmarks.comparison.page_parts import embedded, with_drawing
from benchmarks.comparison.report import game_name
from ppg_env.errors import require
from ppg_env.formats.plan_file import to_json
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.margins import end_of_traffic, mean_displacements
from ppg_env.game.plan import Profile
from ppg_env.plotting.bodies import COLOURS
from ppg_env.plotting.moments import last_step
from ppg_env.support.atomic_write import write_atomically

BORDER = 0.05
"""Free border, as a share of the larger side of the view."""


def write_viewer(game: Game, profile: Profile, path: str) -> None:
    """Write the page of a plan.

    Raises
    ------
    InputError
        If the game is not in two dimensions, or the file cannot be written.
    """
    require(
        game.dim == 2,
        "--html",
        f"is for games in the plane, and this one has {game.dim} dimensions",
        "leave it out, and draw a picture with --out",
    )
    folder = Path(__file__).parent
    problems = evaluate(game, profile).violations()
    page = Template((folder / "viewer.html").read_text(encoding="utf-8")).substitute(
        title=escape(game_name(game)),
        problems="".join(f"<li>not possible: {escape(problem)}</li>" for problem in problems),
        data=embedded(to_json(viewer_data(game, profile))),
        script=with_drawing(folder / "viewer.js"),
    )
    write_atomically(path, page)


def viewer_data(game: Game, profile: Profile) -> dict[str, Any]:
    """Return what the script draws: agents, obstacles, encounters, and the view (x, y, w, h)."""
    paths = [plan.means[: last_step(plan, game) + 1, :2] for plan in profile]
    agents = [
        {
            "name": game.agent_names[i],
            "colour": COLOURS[i % len(COLOURS)],
            "outline": agent.shape.vertices,
            "path": paths[i],
            "goal": agent.goal[:2],
            "leaves": game.on_goal == "remove" and profile[i].arrival is not None,
        }
        for i, agent in enumerate(game.agents)
    ]
    obstacles = [
        {
            "outline": obstacle.shape.vertices,
            "places": obstacle.positions(game.horizon),
            "until": obstacle.until,
        }
        for obstacle in game.obstacles
    ]
    return {
        "agents": agents,
        "obstacles": obstacles,
        "encounters": _encounters(game, profile),
        "last": max(len(path) - 1 for path in paths),
        "view": _view(game, paths),
    }


def _encounters(game: Game, profile: Profile) -> list[dict[str, Any]]:
    arrivals = [plan.arrival for plan in profile]
    return [
        {
            "agents": encounter.agents,
            "obstacle": None if encounter.obstacle is None else f"obstacle {encounter.obstacle}",
            "end": end_of_traffic(game, encounter, arrivals),
            "displacements": displacements,
            "normals": encounter.collision.normals,
            "offsets": encounter.collision.offsets,
        }
        for encounter, displacements in zip(
            game.encounters, mean_displacements(game, profile), strict=True
        )
    ]


def _view(game: Game, paths: list[np.ndarray]) -> list[float]:
    bodies = zip(game.agents, paths, strict=True)
    moved = [(path[:, None] + agent.shape.vertices).reshape(-1, 2) for agent, path in bodies]
    points = np.concatenate([*moved, [agent.goal[:2] for agent in game.agents]])
    low, high = points.min(axis=0), points.max(axis=0)
    border = BORDER * float((high - low).max())
    return [*(low - border), *(high - low + 2 * border)]
