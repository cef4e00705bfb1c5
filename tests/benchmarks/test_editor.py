"""The page on which games are drawn writes game files that the command line reads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from ppg_env.formats.game_file import read_game
from tests.browser import reading

EDITOR = Path(__file__).parents[2] / "docs" / "editor.html"

pytestmark = pytest.mark.slow


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with reading(browser, EDITOR, viewport={"width": 1200, "height": 900}) as opened:
        yield opened


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag the mouse from one point of the game to another."""
    page.locator("svg").scroll_into_view_if_needed()
    box = page.locator("svg").bounding_box()
    assert box is not None
    scale = box["width"] / 100
    ends = [(box["x"] + x * scale, box["y"] + (60 - y) * scale) for x, y in (start, end)]
    page.mouse.move(*ends[0])
    page.mouse.down()
    page.mouse.move(*ends[1], steps=3)
    page.mouse.up()


def game_file(page: Page, tmp_path: Path) -> Path:
    path = tmp_path / "game.toml"
    path.write_text(page.locator("#toml").input_value(), encoding="utf-8")
    return path


def test_a_drawn_game_is_shown_and_solved(page, ppg, tmp_path):
    drag(page, (10, 20), (90, 20))
    page.fill("[name=agentName]", 'the "long" \\ robot')
    page.fill("[name=width]", "9")
    drag(page, (50, 50), (50, 5))
    page.check("[value=obstacle]")
    drag(page, (20, 30), (40, 55))
    path = game_file(page, tmp_path)
    game = read_game(path)
    assert [agent.name for agent in game.agents] == ['the "long" \\ robot', "agent 2"]
    first, second = game.agents
    assert first.start == pytest.approx([10, 20], abs=0.2)
    assert second.goal == pytest.approx([50, 5], abs=0.2)
    assert first.shape.params[0] == pytest.approx([9, 6])
    assert game.obstacles[0].shape.vertices.min(axis=0) == pytest.approx([20, 30], abs=0.2)
    assert (game.horizon, game.objective, game.collisions) == (20, "risk", "swept")
    assert "agent 2" in ppg("show", path).out
    assert ppg("solve", path, "--json").json["status"] == "equilibrium"


def test_things_are_moved_and_deleted(page, tmp_path):
    drag(page, (10, 20), (90, 20))
    drag(page, (30, 40), (60, 40))
    drag(page, (10, 20), (15, 30))
    game = read_game(game_file(page, tmp_path))
    assert game.agents[0].start == pytest.approx([15, 30], abs=0.3)
    assert game.agents[0].goal == pytest.approx([90, 20], abs=0.2)
    page.click("[name=remove]")
    (left,) = read_game(game_file(page, tmp_path)).agents
    assert left.start == pytest.approx([30, 40], abs=0.2)


def test_the_file_is_saved(page, tmp_path):
    drag(page, (10, 20), (90, 20))
    with page.expect_download() as download:
        page.click("#save")
    assert download.value.suggested_filename == "game.toml"
    download.value.save_as(tmp_path / "saved.toml")
    assert (tmp_path / "saved.toml").read_text() == page.locator("#toml").input_value()
