"""Pictures of episodes: what is seen, when it changes, and that nothing is left over."""

from __future__ import annotations

import copy
import pickle
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ppg_env import Agent, Game, InputError, Polytope, path_planning_v0
from ppg_env.env.parallel_env import PathPlanningEnv

pytest.importorskip("PIL", reason="pictures need the extra `render`")

from PIL import Image

from ppg_env.env.canvas import EMBER, FLAME, GREY, Sheet, hatch
from ppg_env.env.gif import write_gif
from ppg_env.env.viewer import CAPTION, EVENT_STEPS
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.obstacle import Obstacle
from tests.marks import first

QUIET = 1e-9
"""Noise so small that straight agents stay on their lines."""


def play(env: PathPlanningEnv, steps: int = 1000) -> list[np.ndarray]:
    """Pictures of the next ``steps`` steps in which all agents head for their goals."""
    pictures = []
    while env.agents and len(pictures) < steps:
        env.step({name: towards_goal(env, name) for name in env.agents})
        pictures.append(env.render())
    return pictures


def towards_goal(env: PathPlanningEnv, name: str) -> np.ndarray:
    i = env.possible_agents.index(name)
    away = env.game.agents[i].goal - env.simulator.state[0, i]
    return away / max(1.0, np.abs(away).max() / 10)


def start(game: Any, seed: int = 0, **options: Any) -> tuple[PathPlanningEnv, np.ndarray]:
    """An environment at time 0, and its picture."""
    env = PathPlanningEnv(game, render_mode="rgb_array", **options)
    env.reset(seed=seed)
    return env, env.render()


def alike(picture: np.ndarray, colour: tuple[int, ...]) -> int:
    """How many pixels have nearly this colour."""
    return int((np.abs(picture.astype(int) - colour).max(axis=2) < 30).sum())


def mover(start: list[float], goal: list[float]) -> Agent:
    sides = [10.0] * len(start)
    return Agent(
        start=np.array(start), goal=np.array(goal), shape=Polytope.box(sides),
        control=Polytope.box([20.0] * len(start)), gain=np.array(0.5),
        noise=QUIET * np.eye(len(start)),
    )  # fmt: skip


def colour_at(picture: np.ndarray, game: Game, point: np.ndarray) -> tuple[int, ...]:
    x, y = Sheet(game).at(point).astype(int)
    return tuple(picture[y + CAPTION, x].tolist())


PASSER_BY = mover([0, 60], [200, 60])
"""An agent that is busy long after all others."""


def test_the_official_render_test(scenario: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from pettingzoo.test import render_test

    monkeypatch.setitem(PathPlanningEnv.metadata, "render_modes", ["rgb_array"])
    render_test(lambda render_mode: path_planning_v0.env(scenario, render_mode=render_mode))


def test_pictures_of_an_episode_have_one_size_and_differ(scenario: str) -> None:
    env, first = start(scenario)
    pictures = [first, *play(env)]
    height, width, colours = first.shape
    assert max(height - CAPTION, width) == 600
    assert (height % 2, width % 2, colours) == (0, 0, 3)
    for before, after in pairwise(pictures):
        assert after.dtype == np.uint8
        assert after.shape == first.shape
        assert (before != after).any()


def test_pictures_are_a_function_of_the_episode() -> None:
    one, other = start("circle(4)", seed=5), start("circle(4)", seed=5)
    pictures = play(one[0])
    for step, picture in enumerate(pictures):
        other[0].step({name: towards_goal(other[0], name) for name in other[0].agents})
        if step % 2:  # leaving some out, and asking twice for others, changes nothing
            np.testing.assert_array_equal(other[0].render(), picture)
            np.testing.assert_array_equal(other[0].render(), picture)


@pytest.mark.parametrize("sigma0", [0.0, 4.0])
def test_a_new_episode_has_nothing_of_the_last(sigma0: float) -> None:
    env, first = start("circle(4)", sigma0=sigma0)
    episode = play(env)
    env.reset(seed=0)
    np.testing.assert_array_equal(env.render(), first)
    for again, before in zip(play(env), episode, strict=True):
        np.testing.assert_array_equal(again, before)


def test_a_viewer_that_comes_late_sees_no_events_of_the_last_episode() -> None:
    env = PathPlanningEnv("head_on", render_mode="rgb_array")
    env.reset(seed=0)
    while env.agents:
        env.step({name: towards_goal(env, name) for name in env.agents})
    env.reset(seed=0)
    np.testing.assert_array_equal(env.render(), start("head_on")[1])


def test_a_viewer_may_come_in_the_middle() -> None:
    env = PathPlanningEnv("circle(4)", render_mode="rgb_array")
    env.reset(seed=0)
    env.step({name: towards_goal(env, name) for name in env.agents})
    pictures = [env.render(), *play(env)]
    assert all((a != b).any() for a, b in pairwise(pictures))


def test_a_crash_bursts_fades_and_leaves_its_mark() -> None:
    env, first = start("head_on", noise=QUIET, on_crash="continue")
    crashed, flames, pictures = [], [], [first]
    while env.agents:
        pictures += play(env, 1)
        crashed.append(bool(env.simulator.last.crashed.any()))
        flames.append(alike(pictures[-1], FLAME))
    first_crash, last_crash = np.flatnonzero(crashed)[[0, -1]]
    assert not any(flames[:first_crash])
    assert flames[first_crash] > 100
    assert alike(pictures[first_crash + 1], EMBER) > 100  # the bodies' edges
    assert not any(flames[last_crash + EVENT_STEPS :])
    assert len(flames) > last_crash + EVENT_STEPS
    middle = np.s_[CAPTION + 100 : -100, 200:-200]
    dark = [(picture[middle].max(axis=2) < 60).sum() for picture in (first, pictures[-1])]
    assert dark[1] > dark[0] + 20  # crosses on the trails


def test_crashed_bodies_are_gone_after_the_crash() -> None:
    pair = mover([0, 0], [90, 0]), mover([40, 0], [0, 0])
    env, _ = start(Game((*pair, PASSER_BY), horizon=25))
    pictures = play(env)
    crash = next(k for k, picture in enumerate(pictures) if alike(picture, FLAME))
    for i in (0, 1):
        corner = env.simulator.state[0, i] + (4.0, 3.5)  # of the body, clear of the trail
        assert colour_at(pictures[crash], env.game, corner) != (255, 255, 255)
        assert colour_at(pictures[crash + EVENT_STEPS], env.game, corner) == (255, 255, 255)


@pytest.mark.parametrize("on_goal", ["remove", "stay"])
def test_arrival_fills_the_goal_and_takes_or_parks_the_body(on_goal: str) -> None:
    env, _ = start(Game((mover([0, 0], [48, 0]), PASSER_BY), horizon=25), on_goal=on_goal)
    pictures, arrival = play(env), 4
    x, y = Sheet(env.game).point(env.game.agents[0].goal).astype(int)
    star = np.s_[CAPTION + y - 10 : CAPTION + y + 10, x - 10 : x + 10]
    corner = np.s_[CAPTION + y - 12 : CAPTION + y - 6, x - 12 : x - 4]  # of the body
    filled = [alike(picture[star], (0, 114, 178)) for picture in pictures]
    assert max(filled[: arrival - 1]) < 20
    assert filled[-1] > 40
    ring = [alike(picture, (0, 91, 142)) for picture in pictures]
    assert ring[arrival] > ring[arrival - 1] + 100
    assert (pictures[arrival - 2][corner] == 255).all()
    assert (pictures[arrival][corner] < 255).any()
    assert (pictures[-1][corner] < 255).any() == (on_goal == "stay")


def test_agents_that_leave_the_field_are_still_named() -> None:
    env, first = start("head_on")
    for _ in range(12):
        env.step({name: np.array([0.0, 10.0]) for name in env.agents})
    picture = env.render()
    assert picture.shape == first.shape
    edge = np.s_[CAPTION + 3 : CAPTION + 16, 10:-10]
    assert alike(first[edge], (0, 91, 142)) == 0
    assert alike(picture[edge], (0, 91, 142)) > 5


def test_positions_that_overflow_are_no_obstacle() -> None:
    env, first = start("head_on", A=3 * np.eye(2), max_cycles=800, tolerance=5.0)
    with np.errstate(all="ignore"):
        for _ in range(700):
            if env.agents:
                env.step({name: np.array([10.0, 10.0]) for name in env.agents})
    assert not np.isfinite(env.simulator.state).all()
    assert env.render().shape == first.shape


@pytest.mark.slow
@pytest.mark.parametrize("dim", [1, 3])
def test_lines_and_space_are_drawn_on_the_plane(dim: int) -> None:
    low, high = np.zeros(dim), np.full(dim, 60.0)
    wall = Polytope.from_vertices(Polytope.box([8.0] * dim).vertices + 30.0)
    game = Game((mover([*low], [*high]), mover([*high], [*low])), (wall,))
    env, first = start(game)
    play(env)
    caption = first[: CAPTION - 2, first.shape[1] // 2 :]
    assert (alike(caption, GREY) > 0) == (dim == 3)  # that this is a shadow
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_go_on_alike(duplicate: Any) -> None:
    env, _ = start("circle(4)", on_crash="continue")
    play(env, 3)
    twin = duplicate(env)
    for one, other in zip(play(env), play(twin), strict=True):
        np.testing.assert_array_equal(one, other)


def test_hatching_lies_within_the_outline() -> None:
    body = Polytope.disc(20.0, 7)
    segments = hatch(body.vertices, 5.0)
    assert len(segments) > 5
    assert body.clearance(np.concatenate(segments)).max() < 1e-9


def test_a_gif_has_every_picture_and_loops(tmp_path: Path) -> None:
    env, first = start("circle(4)")
    pictures = [first, *play(env)]
    path = write_gif(pictures, tmp_path / "episode.gif", fps=5)
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.info["loop"], gif.info["duration"]) == (len(pictures), 0, 200)
        for k, picture in enumerate(pictures):
            gif.seek(k)
            away = np.abs(np.asarray(gif.convert("RGB")).astype(int) - picture)
            assert away.mean() < 1.0
            assert (away[picture.min(axis=2) == 255] == 0).all()  # white stays white
    assert [p.name for p in tmp_path.iterdir()] == ["episode.gif"]


def test_a_gif_of_wrong_pictures_is_refused(tmp_path: Path) -> None:
    picture = np.zeros((4, 6, 3), dtype=np.uint8)
    for frames in ([], [None], [picture, picture[:2]], [picture.astype(float)], [picture[..., 0]]):
        with pytest.raises(InputError, match="frames"):
            write_gif(frames, tmp_path / "no.gif")
    with pytest.raises(InputError, match="fps"):
        write_gif([picture], tmp_path / "no.gif", fps=0)
    with pytest.raises(InputError, match="folder"):
        write_gif([picture], tmp_path / "nowhere" / "no.gif")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("mode", "module", "extra"), [("rgb_array", "PIL", "render"), ("human", "pygame", "human")]
)
def test_a_missing_extra_is_named(
    mode: str, module: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = PathPlanningEnv("head_on", render_mode=mode)
    monkeypatch.setitem(sys.modules, module, None)
    words = rf"install path-planning-games\[{extra}\]"
    if mode == "human":  # which shows the first picture at once
        with pytest.raises(InputError, match=words):
            env.reset(seed=0)
        return
    env.reset(seed=0)
    with pytest.raises(InputError, match=words):
        env.render()


def test_there_is_nothing_to_draw_before_the_first_reset() -> None:
    with pytest.raises(InputError, match="call reset first"):
        PathPlanningEnv("head_on", render_mode="rgb_array").render()


@pytest.fixture
def pygame(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The pygame module with a display that shows nothing, and no waiting."""
    module = pytest.importorskip("pygame", reason="windows need the extra `human`")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setitem(PathPlanningEnv.metadata, "render_fps", 1000)
    module.display.quit()
    yield module
    module.display.quit()


def test_the_official_render_test_with_windows(pygame: Any) -> None:
    from pettingzoo.test import render_test

    render_test(lambda render_mode: path_planning_v0.env("circle(4)", render_mode=render_mode))


def test_a_window_shows_the_picture(pygame: Any) -> None:
    env = PathPlanningEnv("head_on", render_mode="human")
    env.reset(seed=0)
    play(env, 2)
    window = env._viewer._window._window
    shown = pygame.surfarray.array3d(window.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, env._viewer.frame())
    env.close()
    env.close()


def test_the_user_may_close_one_window_and_keep_the_other(pygame: Any) -> None:
    envs = [PathPlanningEnv("head_on", render_mode="human") for _ in range(2)]
    for env in envs:
        env.reset(seed=0)
    closed, kept = (env._viewer._window for env in envs)
    pygame.event.post(pygame.event.Event(pygame.WINDOWCLOSE, window=closed._window))
    assert kept.is_open()  # in either order of reading the events
    assert not closed.is_open()
    for env in envs:
        play(env)
        env.reset(seed=1)
        env.close()


def test_a_window_keeps_the_pace_once_per_step(pygame: Any) -> None:
    env = PathPlanningEnv("head_on", render_mode="human")
    env.reset(seed=0)
    waits: list[float] = []
    env._viewer._window._clock = SimpleNamespace(tick=waits.append)
    play(env, 3)  # renders each of them twice
    assert waits == [1000] * 3
    env.close()


def test_a_missing_display_is_one_sentence(pygame: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("SDL_VIDEODRIVER", "none_such")
        with pytest.raises(InputError, match=r"no display; set DISPLAY, or use 'rgb_array'"):
            PathPlanningEnv("head_on", render_mode="human").reset()
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    with pytest.raises(InputError, match="no display"):
        PathPlanningEnv("head_on", render_mode="human").reset()


def test_moving_obstacles_are_drawn_where_they_are_and_not_once_they_are_gone() -> None:
    block = Obstacle(Polytope.box([8, 8]), [[50.0 - 6 * t, 40.0] for t in range(6)], until=4)
    game = Game((mover([0, 0], [60, 0]),), (block,), horizon=8, on_goal="stay")
    env, picture = start(game)
    sheet, walls = Sheet(game), []
    for t in range(6):
        x, y = sheet.point(np.array([50.0 - 6 * t + 2.0, 42.0])).astype(int)
        walls.append(picture[y + CAPTION, x].max() < 215)
        env.step({"agent_0": np.array([2.0, 0.0])})
        picture = env.render()
    assert walls == [True, True, True, True, False, False]


def test_workspaces_are_outlined_with_dashes() -> None:
    room = HalfSpaces.between([-4.0, -20.0], [64.0, np.inf])
    agent = replace(mover([0, 0], [60, 0]), within=(room,))
    _, framed = start(Game((agent,)))
    _, plain = start(Game((mover([0, 0], [60, 0]),)))
    changed = np.abs(framed.astype(int) - plain).max(axis=2) > 60
    sheet = Sheet(Game((agent,)))
    columns = [sheet.point(np.array([x, 0.0]))[0] for x in (-4.0, 64.0)]
    for x in columns:
        share = changed[CAPTION + 1 : -1, round(x) - 1 : round(x) + 2].any(axis=1).mean()
        assert 0.3 < share < 0.8, "a dashed line from top to bottom"
    assert changed[:, int(columns[0]) + 4 : int(columns[1]) - 4].mean() < 0.01


@pytest.mark.parametrize("dim", first(1, [1, 3]))
def test_workspaces_are_drawn_in_every_dimension(dim: int) -> None:
    room = HalfSpaces.between([-4.0, *[-30.0] * (dim - 1)], [64.0, *[30.0] * (dim - 1)])
    agent = mover([0.0] * dim, [60.0, *[0.0] * (dim - 1)])
    _, framed = start(Game((replace(agent, within=(room,)),)))
    _, plain = start(Game((agent,)))
    assert (framed != plain).any(axis=2).sum() > 100
