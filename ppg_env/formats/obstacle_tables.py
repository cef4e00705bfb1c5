"""Tables of obstacles in game files: bodies at rest or on a path, and polygons of any form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.formats.keys import check_keys
from ppg_env.formats.polytope_tables import MOST_ROWS, SHAPE_KEYS, body_of, shape_table
from ppg_env.game.convex_pieces import convex_pieces
from ppg_env.game.obstacle import Obstacle

MOTION_KEYS = ("path", "noise", "until")
OBSTACLE_KEYS = (*SHAPE_KEYS, "polygon", *MOTION_KEYS)


def read_obstacles(table: Mapping[str, Any]) -> list[Obstacle]:
    """Return the obstacle of a table, or the convex pieces of its ``polygon``.

    Raises
    ------
    InputError
        If the table does not describe one.
    """
    check_keys(table, OBSTACLE_KEYS, "[[obstacle]]")
    motion = {key: table[key] for key in MOTION_KEYS if key in table}
    body = {key: value for key, value in table.items() if key not in MOTION_KEYS}
    if "polygon" not in body:
        return [Obstacle(body_of(body), **motion)]
    extra = sorted(set(body) - {"polygon"})
    if extra:
        raise InputError(extra[0], "cannot be combined with polygon", "remove one of them")
    corners = body["polygon"]
    count = len(corners) if isinstance(corners, list) else 0
    require(count <= MOST_ROWS, "polygon", f"has {count} points", f"write at most {MOST_ROWS}")
    pieces = convex_pieces(body["polygon"])
    require(
        len(pieces) == 1 or not np.any(motion.get("noise", 0.0)),
        "noise",
        "is given for a polygon of several convex pieces, whose errors would not be shared",
        "write convex obstacles with vertices, or remove the noise",
    )
    return [Obstacle(piece, **motion) for piece in pieces]


def obstacle_table(obstacle: Obstacle) -> dict[str, Any]:
    """Return the table that :func:`read_obstacles` reads back exactly."""
    table = shape_table(obstacle.shape)
    if obstacle.path is not None:
        table["path"] = obstacle.path.tolist()
    if np.any(obstacle.noise):
        table["noise"] = obstacle.noise.tolist()
    if obstacle.until is not None:
        table["until"] = int(obstacle.until)
    return table
