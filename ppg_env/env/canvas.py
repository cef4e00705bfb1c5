"""The field and the canvas that pictures of episodes are drawn on.

Pictures are drawn SMOOTH times too large and then reduced, which smooths all edges.  Needs the
extra ``render`` (Pillow).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ppg_env.errors import InputError
from ppg_env.game.game import Game
from ppg_env.plotting.bodies import outline, plane

if TYPE_CHECKING:
    from PIL.Image import Image

Colour = tuple[int, ...]

SIDE = 600
"""Pixels of the field's longer side."""

SLIMMEST = 0.6
"""Smallest ratio of the field's sides: leaves room to dodge, and for the caption."""

MARGIN = 0.06
"""Space around starts, goals and obstacles, as a share of the longer side."""

SMOOTH = 3
"""Samples per side of a pixel; with two, edges look rough; four take twice the time."""

FONT = 14
"""Height of letters in pixels."""

DASH, GAP = 6.0, 4.0
"""Lengths of dashes, and between them, in pixels."""

SMALLEST_LABEL = 12.0
"""Bodies narrower than this, in pixels, get no number."""

WHITE, INK, GREY = (255, 255, 255), (40, 40, 40), (150, 150, 150)
GRID, WALL, WALL_EDGE = (236, 236, 236), (190, 190, 190), (120, 120, 120)
FLAME, EMBER = (240, 228, 66), (180, 20, 20)


class Sheet:
    """The visible part of the plane and its map to pixels of the picture."""

    def __init__(self, game: Game) -> None:
        self._dim = game.dim
        corners = [
            outline(obstacle.vertices_at(t))
            for obstacle in game.obstacles
            for t in range(min(obstacle.rest, 2 * game.horizon) + 1)
        ]
        for agent in game.agents:
            body = outline(agent.shape.vertices)
            corners += [
                body + plane(agent.start[: game.dim]),
                body + plane(agent.goal[: game.dim]),
            ]
        points = np.concatenate(corners)
        low, high = points.min(axis=0), points.max(axis=0)
        extent = (high - low) + 2 * MARGIN * (high - low).max()
        extent = np.maximum(extent, SLIMMEST * extent.max())
        self._extent = extent
        self._scale = SIDE / extent.max()
        self._corner = (low + high) / 2 + extent * (-0.5, 0.5)  # top left
        # Even numbers of pixels, as video encoders require.
        self.width, self.height = (int(2 * round(side * self._scale / 2)) for side in extent)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (..., 2) of points of the plane; rows of pixels run downwards."""
        return (points - self._corner) * (self._scale, -self._scale)

    def point(self, position: np.ndarray) -> np.ndarray:
        """Return the pixel (2,) of the position in a state."""
        return self.at(np.array(plane(position[: self._dim]), dtype=np.float64))

    def shape(self, vertices: np.ndarray) -> np.ndarray:
        """Return the outline (V, 2) of a body around its reference point, in pixels."""
        return outline(vertices) * (self._scale, -self._scale)

    def ground(self, game: Game, colours: Sequence[Colour]) -> Canvas:
        """Return a new canvas with the static parts: grid, obstacles, workspaces, start marks."""
        canvas = Canvas(self.width, self.height)
        unit = _round_length(self._extent.max() / 5)
        self._draw_grid(canvas, unit)
        for obstacle in game.obstacles:
            if obstacle.path is None:
                canvas.polygon(self.at(outline(obstacle.shape.vertices)), WALL, WALL_EDGE, 1.6)
        self._draw_workspaces(canvas, game, colours)
        for agent, colour in zip(game.agents, colours, strict=False):  # some may be missing
            canvas.disc(self.point(agent.start), 5.0, WHITE, mix(colour, 0.7), 1.8)
        self._draw_scale(canvas, unit)
        canvas.polygon(canvas.frame(), None, GREY, 1.0)
        return canvas

    def _draw_grid(self, canvas: Canvas, unit: float) -> None:
        (left, top), (width, height) = self._corner, self._extent
        for x in unit * np.arange(np.ceil(left / unit), (left + width) / unit):
            canvas.line(self.at(np.array([[x, top], [x, top - height]])), GRID, 1.0)
        for y in unit * np.arange(np.ceil((top - height) / unit), top / unit):
            canvas.line(self.at(np.array([[left, y], [left + width, y]])), GRID, 1.0)

    def _draw_workspaces(self, canvas: Canvas, game: Game, colours: Sequence[Colour]) -> None:
        """Draw the outlines of workspaces given in positions, grey where several agents share one.

        In space, those are the faces parallel to the third axis.
        """
        regions = [(region, i) for i, a in enumerate(game.agents) for region in a.within]
        for region in dict.fromkeys(region for region, _ in regions if region.dim == game.dim):
            users = [i for other, i in regions if other == region]
            colour = mix(colours[users[0]], 0.7) if len(users) == 1 else GREY
            normals = np.zeros((len(region.normals), 2))
            normals[:, : min(game.dim, 2)] = region.normals[:, :2]
            upright = np.abs(region.normals[:, 2:]).max(axis=1, initial=0.0) == 0
            around = self.at_frame(2.0)  # its own sides are outside of the picture
            edges = clip_polygon(around, normals[upright], region.offsets[upright])
            for start, end in zip(edges, np.roll(edges, -1, axis=0), strict=True):
                canvas.dashes(self.at(np.stack([start, end])), colour, 1.2)

    def at_frame(self, wider: float) -> np.ndarray:
        """Return the corners (4, 2) of a field ``wider`` times as large, counter-clockwise."""
        centre, half = self._corner + self._extent * (0.5, -0.5), wider * self._extent / 2
        return centre + half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])

    def _draw_scale(self, canvas: Canvas, unit: float) -> None:
        right, y = self.width - 12.0, self.height - 12.0
        left = right - unit * self._scale
        canvas.line(np.array([[left, y], [right, y]]), GREY, 1.6)
        for x in (left, right):
            canvas.line(np.array([[x, y - 3.0], [x, y + 3.0]]), GREY, 1.6)
        canvas.text(np.array([(left + right) / 2, y - 10.0]), f"{unit:g}", GREY)


class Canvas:
    """An image SMOOTH times too large; coordinates are pixels of the picture, colours blend."""

    def __init__(self, width: int, height: int) -> None:
        from PIL import Image

        self._set_image(Image.new("RGB", (width * SMOOTH, height * SMOOTH), WHITE))

    def _set_image(self, image: Image) -> None:
        from PIL import ImageDraw

        self.image = image
        self._draw = ImageDraw.Draw(image, "RGBA")

    def copy(self) -> Canvas:
        """Return another canvas with the same picture on it."""
        duplicate = object.__new__(Canvas)
        duplicate._set_image(self.image.copy())
        return duplicate

    def frame(self) -> np.ndarray:
        """Return the outline of the whole canvas."""
        width, height = self.image.width / SMOOTH, self.image.height / SMOOTH
        return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])

    def line(self, points: np.ndarray, colour: Colour, width: float) -> None:
        """Draw straight segments from each of ``points`` (P, 2) to the next."""
        self._draw.line(_flat(points), fill=colour, width=_whole(width))

    def dashes(self, ends: np.ndarray, colour: Colour, width: float) -> None:
        """Draw a dashed segment between two ``ends`` (2, 2)."""
        length = float(np.hypot(*(ends[1] - ends[0])))
        for start in np.arange(0.0, length, DASH + GAP):
            shares = np.array([[start], [min(start + DASH, length)]]) / length
            self.line(ends[0] + shares * (ends[1] - ends[0]), colour, width)

    def polygon(self, points: np.ndarray, fill: Colour | None, edge: Colour, width: float) -> None:
        """Draw a polygon with corners ``points`` (P, 2)."""
        corners = _flat(points)
        if fill is not None:
            self._draw.polygon(corners, fill=fill)
        # Pillow's own wide outlines make a mask of the whole image for each polygon.
        self._draw.line([*corners, *corners[:4]], fill=edge, width=_whole(width))

    def disc(
        self,
        centre: np.ndarray,
        radius: float,
        fill: Colour | None,
        edge: Colour | None = None,
        width: float = 0.0,
    ) -> None:
        """Draw a disc, or a ring without ``fill``."""
        box = _flat(np.stack([centre - radius, centre + radius]))
        self._draw.ellipse(box, fill=fill, outline=edge, width=_whole(width))

    def cross(self, centre: np.ndarray, radius: float, colour: Colour, width: float) -> None:
        """Draw an upright cross turned by 45 degrees."""
        for arm in (np.array([radius, radius]), np.array([radius, -radius])):
            self.line(np.stack([centre - arm, centre + arm]), colour, width)

    def text(self, centre: np.ndarray, text: str, colour: Colour) -> None:
        """Draw text centred at a point."""
        font = font_of((FONT - 2) * SMOOTH)
        x, y = _flat(centre)
        self._draw.text((x, y), text, fill=colour, font=font, anchor="mm")


def hatch(outline: np.ndarray, gap: float) -> list[np.ndarray]:
    """Return the diagonals x + y = k ``gap``, as segments, inside a convex ``outline`` (V, 2)."""
    height, following = outline.sum(axis=1), np.roll(outline, -1, axis=0)
    segments = []
    for level in np.arange(np.ceil(height.min() / gap), height.max() / gap) * gap:
        before, after = height - level, np.roll(height, -1) - level
        crossed = (before > 0) != (after > 0)
        share = (before[crossed] / (before - after)[crossed])[:, None]
        ends = outline[crossed] + share * (following - outline)[crossed]
        if len(ends) == 2:
            segments.append(ends)
    return segments


def clip_polygon(corners: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the corners (V, 2) of the part of a convex polygon where normals x <= offsets."""
    for normal, offset in zip(normals, offsets, strict=True):
        beyond = corners @ normal - offset
        kept = []
        for k, corner in enumerate(corners):
            before = beyond[k - 1]
            if (before > 0) != (beyond[k] > 0):
                share = before / (before - beyond[k])
                kept.append(corners[k - 1] + share * (corner - corners[k - 1]))
            if beyond[k] <= 0:
                kept.append(corner)
        corners = np.array(kept).reshape(-1, 2)
    return corners


def star(spikes: int, outer: float, inner: float) -> np.ndarray:
    """Return the corners (2 spikes, 2) of a star around the origin, one spike up."""
    angles = np.pi * np.arange(2 * spikes) / spikes - np.pi / 2
    radii = np.where(np.arange(2 * spikes) % 2, inner, outer)[:, None]
    return radii * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _round_length(length: float) -> float:
    """Return the largest of ..., 1, 2, 5, 10, 20, ... that is not larger than ``length``."""
    decade = 10.0 ** np.floor(np.log10(length))
    return float(max(step * decade for step in (1, 2, 5) if step * decade <= length))


def _flat(points: np.ndarray) -> list[float]:
    return (points * SMOOTH).ravel().tolist()


def _whole(width: float) -> int:
    return round(width * SMOOTH)


def rgb(code: str) -> Colour:
    """Return the colour of a code such as ``#0072B2``."""
    return tuple(bytes.fromhex(code[1:]))


def shade(colour: Colour, share: float) -> Colour:
    """Darken a colour to ``share``, the rest black; on thin lines yellow is too pale."""
    return tuple(round(share * c) for c in colour)


def mix(colour: Colour, share: float) -> Colour:
    """Lighten a colour to ``share``, the rest white."""
    return tuple(round(share * c + (1 - share) * 255) for c in colour)


@lru_cache(maxsize=8)
def font_of(size: int) -> Any:
    """Return the font that comes with Pillow, the same on all machines."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


def need_pillow() -> None:
    """Raise :class:`InputError` if Pillow is missing."""
    try:
        import PIL  # noqa: F401 - only to find out whether it is installed
    except ImportError:
        raise InputError("picture", "needs Pillow", "install path-planning-games[render]") from None
