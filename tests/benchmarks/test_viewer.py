"""``ppg render --html``: one page that plays a plan."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from benchmarks.comparison.viewer import write_viewer
from ppg_env import make_game, straight_plan
from ppg_env.formats.plan_file import read_plan
from ppg_env.game.game import Game
from ppg_env.game.margins import mean_displacements
from ppg_env.game.plan import Profile
from tests.browser import reading

HOSTILE = "</script><b>robot</b>"


@pytest.fixture(scope="module")
def plan() -> tuple[Game, Profile]:
    """Straight flight of two agents through each other, one of them with a hostile name."""
    game = make_game("head_on", speed="l1")
    first, second = game.agents
    game = replace(game, name="a <i>game</i>", agents=(replace(first, name=HOSTILE), second))
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return game, tuple(plan for plan in plans if plan is not None)


@pytest.fixture(scope="module")
def path(plan: tuple[Game, Profile], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("viewer") / "plan.html"
    write_viewer(*plan, str(path))
    return path


@pytest.fixture
def page(browser: Browser, path: Path) -> Iterator[Page]:
    with reading(browser, path, viewport={"width": 1000, "height": 800}) as opened:
        yield opened


def bodies(page: Page) -> np.ndarray:
    """Where the bodies are drawn; y points down on screens."""
    moved = page.locator(".body").evaluate_all(
        "all => all.map(b => b.transform.baseVal.consolidate().matrix).map(m => [m.e, -m.f])"
    )
    return np.array(moved)


def test_the_command_writes_the_page_and_no_picture(ppg, plan_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert ppg("render", plan_file, "--html", "plan.html", "--json").json["page"] == "plan.html"
    assert [file.name for file in tmp_path.iterdir()] == ["plan.html"]
    data = re.findall(r'id="data">(.*?)</script>', Path("plan.html").read_text(), re.S)
    _, profile, _ = read_plan(plan_file)
    for agent, plan in zip(json.loads(data[0])["agents"], profile, strict=True):
        assert plan.arrival is not None
        assert np.array_equal(agent["path"], plan.means[: plan.arrival + 1, :2])


@pytest.mark.parametrize(
    ("words", "reason"),
    [(("head_on",), "is for plans"), (("head_on", "--html", "x.txt"), "does not end in .html")],
)
def test_what_cannot_be_played_is_refused(ppg, tmp_path, monkeypatch, words, reason):
    monkeypatch.chdir(tmp_path)
    options = () if "--html" in words else ("--html", "x.html")
    assert reason in ppg("render", *words, *options, code=2).err
    assert list(tmp_path.iterdir()) == []


def test_a_plan_in_space_is_refused(ppg, tmp_path):
    plan = tmp_path / "plan.json"
    ppg("solve", "intersection_3d", "--out", plan)
    done = ppg("render", plan, "--html", tmp_path / "plan.html", code=2)
    assert "this one has 3 dimensions" in done.err
    assert not (tmp_path / "plan.html").exists()


@pytest.mark.slow
def test_names_are_text(page, plan):
    assert page.title() == plan[0].name
    assert page.locator("h1").inner_text() == plan[0].name
    assert page.locator("b, i").count() == 0
    page.locator(".body").nth(0).focus()
    assert page.locator("#hover").inner_text().startswith(f"{HOSTILE}, t = 0.00")


@pytest.mark.slow
def test_bodies_are_where_the_means_are(page, plan):
    _, profile = plan
    for time in (0.0, 3.5, 8.0):
        page.locator("[name=time]").fill(str(time))
        means = [
            [np.interp(time, range(len(p.means)), axis) for axis in p.means.T[:2]] for p in profile
        ]
        assert bodies(page) == pytest.approx(np.array(means), abs=1e-4)


@pytest.mark.slow
def test_pointing_at_a_body_shows_its_clearance(page, plan):
    game, profile = plan
    collision = game.encounters[0].collision
    clearances = mean_displacements(game, profile)[0] @ collision.normals.T - collision.offsets
    for time in (1, 4):
        page.locator("[name=time]").fill(str(time))
        page.locator(".body").nth(0).hover(force=True)
        shown = page.locator("#hover").inner_text()
        assert f"t = {time}.00" in shown
        assert f"clearance {clearances[time].max():.3f} to agent_1" in shown


@pytest.mark.slow
def test_play_moves_the_bodies_and_pauses(page):
    start = bodies(page)
    page.click("[name=play]")
    expect(page.locator("[name=time]")).not_to_have_js_property("value", "0")
    page.click("[name=play]")
    paused = bodies(page)
    assert np.abs(paused - start).max() > 0
    page.wait_for_timeout(200)
    assert np.array_equal(bodies(page), paused)
    assert page.locator("[name=play]").inner_text() == "Play"


@pytest.mark.slow
def test_the_page_says_what_is_impossible(page):
    assert "overlap" in page.locator("#problems").inner_text()
