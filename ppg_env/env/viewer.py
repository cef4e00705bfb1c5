"""Pictures of an episode as it is played, as arrays or in a window.

Layers from bottom to top: grid, workspaces (dashed) and obstacles at rest; start marks (rings);
moving obstacles where they are, a dot per step; trails of realised positions
(a dot per step, a cross at a crash, a large dot at an arrival); goals (stars: hollow while their
agent is in traffic, filled after its arrival, grey after its crash); bodies with their agent's
number (parked ones hatched); events of the last few steps (rings for arrivals, bursts for
crashes).  The field does not move: an agent outside is shown by its number at the border.

Needs the extra ``render`` (Pillow); the window needs ``human`` (pygame-ce) as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ppg_env.env.canvas import (
    EMBER,
    FLAME,
    FONT,
    GREY,
    INK,
    SIDE,
    SMALLEST_LABEL,
    SMOOTH,
    WALL,
    WALL_EDGE,
    WHITE,
    Canvas,
    Sheet,
    font_of,
    hatch,
    mix,
    need_pillow,
    rgb,
    shade,
    star,
)
from ppg_env.env.observation import moving_obstacles
from ppg_env.env.status import ARRIVED, CRASHED, TRAFFIC
from ppg_env.env.window import Window
from ppg_env.game.game import Game
from ppg_env.plotting.bodies import COLOURS, plane

if TYPE_CHECKING:
    from PIL.Image import Image

    from ppg_env.env.simulator import Simulator

EVENT_STEPS = 4
"""Steps for which an event stays visible: one second at the environment's ``render_fps``."""

CAPTION = 28
"""Height of the strip above the field, in pixels."""

FAR = 10.0 * SIDE
"""Positions are clipped to this distance, in pixels, because unstable dynamics are unbounded."""


class Moment(NamedTuple):
    """One time of an episode, in pixels.

    points (N, 2); status, arrived, crashed (N,); contacts (K, 2), the places where bodies overlap;
    obstacles, the outlines (V, 2) of the moving obstacles that are there.
    """

    points: np.ndarray
    status: np.ndarray
    arrived: np.ndarray
    crashed: np.ndarray
    contacts: np.ndarray
    obstacles: tuple[np.ndarray, ...]


class Viewer:
    """Draws the first copy of a simulator from what has been recorded since time 0.

    Parameters
    ----------
    game
        Game that is played; it fixes the field.
    fps
        Frames per second of the window.
    """

    def __init__(self, game: Game, fps: float) -> None:
        need_pillow()
        self._game, self._fps = game, fps
        self._sheet = Sheet(game)
        self._colours = [rgb(COLOURS[i % len(COLOURS)]) for i in range(len(game.agents))]
        self._inks = [shade(colour, 0.8) for colour in self._colours]
        self._show_game(game)
        self._burst = min(max(min(self._radii), 16.0), 60.0)
        self._moving = [game.obstacles[k] for k in moving_obstacles(game)]
        ends = [(pair.agents[0], pair.agents[-1]) for pair in game.encounters]
        self._sides = np.array(ends, dtype=np.intp).reshape(-1, 2)
        self._simulator: Simulator | None = None
        self._time, self._last_time, self._parks = 0, 0, False
        self._clear()
        self._window: Window | None = None
        self._shown: Moment | None = None

    def record(self, simulator: Simulator) -> None:
        """Record positions and the outcome of the last step; at time 0 a new recording starts."""
        unknown, self._simulator = self._simulator is None, simulator
        self._time, self._last_time = int(simulator.clock[0]), simulator.max_cycles
        self._parks = simulator.rules.on_goal == "stay"
        happened = self._time > 0  # at time 0 the flags are those of the previous episode
        if not happened:
            self._clear()
        if unknown or not happened:
            self._show_game(simulator.game_of())
        state = np.nan_to_num(simulator.state[0, :, : self._game.dim])  # unstable dynamics overflow
        points = np.clip(self._sheet.at(np.stack(plane(state.T), axis=1)), -FAR, FAR)
        last = simulator.last
        moment = Moment(
            points,
            simulator.status[0].copy(),
            last.arrived[0] & happened,
            last.crashed[0] & happened,
            self._contacts(points, last.overlap[0] & happened),
            self._obstacles(simulator),
        )
        self._moments.append(moment)
        self._arrived |= moment.arrived | (moment.status == ARRIVED)
        self._crashed |= moment.crashed | (moment.status == CRASHED)

    def frame(self) -> np.ndarray:
        """Return the picture of the last recorded moment, (H, W, 3) uint8."""
        from PIL import Image

        canvas = self._painted_trails().copy()
        for outline in self._moments[-1].obstacles:
            canvas.polygon(outline, (*WALL, 200), WALL_EDGE, 1.6)
        self._draw_goals(canvas)
        for age in range(EVENT_STEPS - 1, 0, -1):
            self._draw_events(canvas, age)
        self._draw_bodies(canvas)
        self._draw_events(canvas, age=0)
        field = canvas.image.reduce(SMOOTH)
        page = Image.new("RGB", (field.width, field.height + CAPTION), WHITE)
        page.paste(field, (0, CAPTION))
        self._write(page)
        return np.array(page)

    def show(self) -> None:
        """Show the picture in a window at the frame rate; no effect once the user has closed it."""
        if self._window is None:
            size = self._sheet.width, self._sheet.height + CAPTION
            self._window = Window(self._game.name or "path planning game", size, self._fps)
        if self._window.is_open():
            moment = self._moments[-1]
            self._window.show(self.frame(), wait=moment is not self._shown)
            self._shown = moment

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without canvas and window, which a copy creates for itself."""
        return vars(self) | {"_canvas": None, "_painted": 0, "_window": None}

    def _show_game(self, game: Game) -> None:
        """Take starts, goals and bodies from the game of the episode; the field stays."""
        self._played = game
        self._outlines = [self._sheet.shape(agent.shape.vertices) for agent in game.agents]
        self._hatches = [hatch(outline, 6.0) for outline in self._outlines]
        self._radii = [float(np.hypot(*outline.T).max()) for outline in self._outlines]

    def _clear(self) -> None:
        self._moments: list[Moment] = []
        self._canvas: Canvas | None = None
        self._painted = 0  # moments that are on the canvas
        self._arrived = np.zeros(len(self._game.agents), dtype=np.bool_)
        self._crashed = np.zeros(len(self._game.agents), dtype=np.bool_)

    def _contacts(self, points: np.ndarray, overlap: np.ndarray) -> np.ndarray:
        """Return for each agent in an overlap the centre of its contacts, duplicates removed.

        A contact is half-way between two agents, or at the agent for an obstacle.
        """
        sides = self._sides[overlap]
        middles = points[sides].mean(axis=1)
        sums, counts = np.zeros_like(points), np.zeros((len(points), 1))
        np.add.at(sums, sides, middles[:, None])
        np.add.at(counts, sides, 1.0)
        hit = counts[:, 0] > 0
        return np.unique((sums[hit] / counts[hit]).round(3), axis=0)

    def _obstacles(self, simulator: Simulator) -> tuple[np.ndarray, ...]:
        places = simulator.bodies[0, len(self._game.agents) :]
        return tuple(
            self._sheet.shape(obstacle.shape.vertices) + self._sheet.point(place)
            for obstacle, place in zip(self._moving, places, strict=True)
            if obstacle.until is None or self._time < obstacle.until
        )

    def _painted_trails(self) -> Canvas:
        """Return the canvas with ground and trails up to the last moment."""
        if self._canvas is None:
            self._canvas = self._sheet.ground(self._played, self._inks)
        for k in range(self._painted, len(self._moments)):
            if k > 0:
                self._paint_step(self._canvas, self._moments[k - 1], self._moments[k])
            self._paint_marks(self._canvas, self._moments[k])
            for outline in self._moments[k].obstacles:
                self._canvas.disc(outline.mean(axis=0), 1.6, WALL_EDGE)
        self._painted = len(self._moments)
        return self._canvas

    def _paint_step(self, canvas: Canvas, before: Moment, after: Moment) -> None:
        for i in np.flatnonzero(before.status == TRAFFIC):
            line = np.stack([before.points[i], after.points[i]])
            canvas.line(line, mix(self._inks[i], 0.6), 2.0)
            canvas.disc(before.points[i], 2.4, self._inks[i])
        self._paint_marks(canvas, before)  # the new lines must not cover them

    def _paint_marks(self, canvas: Canvas, moment: Moment) -> None:
        for i in np.flatnonzero(moment.arrived):
            canvas.disc(moment.points[i], 4.5, self._inks[i], WHITE, 1.0)
        for i in np.flatnonzero(moment.crashed):
            canvas.cross(moment.points[i], 5.0, WHITE, 5.0)
            canvas.cross(moment.points[i], 5.0, INK, 2.5)

    def _draw_goals(self, canvas: Canvas) -> None:
        status = self._moments[-1].status
        for i, agent in enumerate(self._played.agents):
            colour = GREY if status[i] == CRASHED else self._inks[i]
            fill = self._colours[i] if status[i] == ARRIVED else WHITE
            mark = star(5, 10.0, 4.5) + self._sheet.point(agent.goal)
            canvas.polygon(mark, fill, colour, 1.8)

    def _draw_bodies(self, canvas: Canvas) -> None:
        moment = self._moments[-1]
        for i, outline in enumerate(self._outlines):
            colour, place = self._colours[i], moment.points[i]
            edge = EMBER if moment.crashed[i] else self._inks[i]
            if moment.status[i] == ARRIVED and self._parks:
                for segment in self._hatches[i]:
                    canvas.line(segment + place, mix(self._inks[i], 0.5), 1.2)
                canvas.polygon(outline + place, (*colour, 25), edge, 1.6)
            elif moment.status[i] == TRAFFIC or moment.crashed[i]:
                canvas.polygon(outline + place, (*colour, 110), edge, 1.6)
            elif moment.arrived[i]:
                canvas.polygon(outline + place, (*colour, 40), mix(edge, 0.5), 1.2)

    def _draw_events(self, canvas: Canvas, age: int) -> None:
        """Draw the events of ``age`` steps ago, which fade with age."""
        if age >= len(self._moments):
            return
        moment, left = self._moments[-1 - age], 1.0 - age / EVENT_STEPS
        opaque = int(255 * left)
        for i in np.flatnonzero(moment.arrived):
            radius = self._radii[i] + 4.0 + 5.0 * age
            canvas.disc(moment.points[i], radius, None, (*self._inks[i], opaque), 2.5)
        radius = self._burst * (0.4 + 0.4 * left)
        burst = star(9, radius, 0.5 * radius)
        for place in moment.contacts:
            canvas.polygon(burst + place, (*FLAME, int(0.9 * opaque)), (*EMBER, opaque), 1.6)

    def _write(self, page: Image) -> None:
        """Write the agents' numbers on their bodies, and the caption."""
        from PIL import ImageDraw

        draw, moment = ImageDraw.Draw(page), self._moments[-1]
        parked = (moment.status == ARRIVED) & self._parks
        visible = (moment.status == TRAFFIC) | parked | moment.crashed | moment.arrived
        low, high = np.array([9, CAPTION + 9]), np.array([page.width - 9, page.height - 9])
        for i in np.flatnonzero(visible):
            if 2 * self._radii[i] < SMALLEST_LABEL:
                continue
            below = FONT if parked[i] else 0  # clear of the goal's star
            place = moment.points[i] + (0, CAPTION + below)
            x, y = np.clip(place, low, high)
            colour = INK if (x, y) == tuple(place) else self._inks[i]  # at the border, its own
            draw.text(
                (x, y), str(i), fill=colour, font=font_of(FONT - 1), anchor="mm",
                stroke_width=3, stroke_fill=WHITE,
            )  # fmt: skip
        draw.text((8, CAPTION / 2), self._caption(), fill=INK, font=font_of(FONT), anchor="lm")
        if self._game.dim > 2:
            corner = page.width - 8, CAPTION / 2
            draw.text(corner, "shadow on x, y", fill=GREY, font=font_of(FONT), anchor="rm")

    def _caption(self) -> str:
        arrived, crashed = int(self._arrived.sum()), int(self._crashed.sum())
        return f"t = {self._time} of {self._last_time}   arrived {arrived}   crashed {crashed}"
