"""The report, as a reader's browser shows it, against the rows of the store."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import replace
from html import unescape
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text
from playwright.sync_api import Browser, Page, expect

from benchmarks.comparison.page_parts import embedded
from benchmarks.reproduction.curves import make_panel
from benchmarks.reproduction.extent import BEST_RESPONSE, EQUILIBRIA, SOCIAL, Extent, Place, Setting
from benchmarks.reproduction.page import page as whole_page
from benchmarks.reproduction.page import write_page
from benchmarks.reproduction.pictures import draw
from benchmarks.reproduction.run import Reproduction, judge_claims, reproduce
from benchmarks.sweeps import Row, Store
from tests.browser import reading

SIDES = ("selfish", "social")
NEAR = 1e-3
"""Coordinates are rounded to three decimals."""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("store") / "cells.db"


@pytest.fixture(scope="module")
def found(store: Path) -> Reproduction:
    extent = Extent(
        settings=(Setting("l1", 3.0),),
        scenarios=("head_on", "intersection"),
        lams=(0.3, 0.6, 0.8),
        episodes=200,
    )
    return reproduce(extent, store)


@pytest.fixture(scope="module")
def report(found: Reproduction, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_page(found, str(path))
    return path


@pytest.fixture
def page(browser: Browser, report: Path) -> Iterator[Page]:
    with reading(browser, report, viewport={"width": 1200, "height": 900}) as opened:
        yield opened


def choose(page: Page, place: Place, equilibrium: str) -> None:
    for name, value in {
        "setting": str(place.setting),
        "scenario": place.scenario,
        "gain": f"{place.gain:g}",
        "equilibrium": equilibrium,
    }.items():
        page.select_option(f"[name={name}]", value)


def slide(page: Page, name: str, to: int) -> None:
    """Move a slider."""
    slider = page.locator(f"[name={name}]")
    slider.fill(str(min(to, int(slider.get_attribute("max") or to))))


def shown(page: Page, side: str, quantity: str) -> list[object]:
    """The exact values behind the cells of a line of numbers."""
    cells = page.locator(f"#{side} [data-quantity={quantity}]")
    return [json.loads(text) for text in cells.evaluate_all("all => all.map(c => c.dataset.value)")]


def words(page: Page, side: str, quantity: str) -> list[str]:
    return page.locator(f"#{side} [data-quantity={quantity}]").all_inner_texts()


def bodies(page: Page, side: str) -> np.ndarray:
    """(N, 2) where the bodies are drawn, read off their transforms; y points down on screens."""
    moved = page.locator(f"#{side} .body").evaluate_all(
        "all => all.map(b => b.transform.baseVal.consolidate().matrix).map(m => [m.e, -m.f])"
    )
    return np.array(moved)


def means(row: Row, time: int) -> np.ndarray:
    """(N, 2) means at a time, or at arrival if that is earlier."""
    assert row.means is not None
    assert row.arrival is not None
    last = [row.horizon if end is None else end for end in row.arrival]
    return np.array([mine[min(time, end)] for mine, end in zip(row.means, last, strict=True)])


def rows(found: Reproduction, store: Path, place: Place, name: str, k: int) -> list[Row]:
    """The equilibrium's and the optimum's row, from the store."""
    cells = found.extent.cells(place)
    with Store(store) as base:
        read = [base.get(cells[one][k].address) for one in (name, SOCIAL)]
    return [row for row in read if row is not None]


def test_the_lam_slider_shows_the_numbers_of_the_rows(page, found, store):
    everything = list(product(found.panels, EQUILIBRIA, range(len(found.extent.lams))))
    for place, name, k in everything[::4]:
        choose(page, place, name)
        slide(page, "lam", k)
        assert page.locator("[name=lamShown]").inner_text() == f"λ = {found.extent.lams[k]:g}"
        for side, row in zip(SIDES, rows(found, store, place, name, k), strict=True):
            *each, mean = shown(page, side, "arrival")
            assert each == row.arrival
            assert mean == pytest.approx(np.mean(row.arrival))
            for quantity, values in (("objective", row.shifted_cost), ("safety", row.deficit)):
                *each, mean = shown(page, side, quantity)
                assert each == pytest.approx(values, rel=1e-5)
                assert mean == pytest.approx(np.mean(values), rel=1e-5)
                assert words(page, side, quantity)[-1] == f"{mean:.2f}"
            crash = [
                row.crash_probability, row.crash_probability_low, row.crash_probability_high
            ]  # fmt: skip
            assert shown(page, side, "crash") == [pytest.approx(crash, rel=1e-5)]
            assert shown(page, side, "risk-bound") == [pytest.approx(row.risk_bound_any, rel=1e-5)]
            *regret, _ = shown(page, side, "regret")
            if row.regret is None:
                assert regret == [None] * row.agents
            else:
                assert regret == pytest.approx(row.regret, rel=1e-5)


def test_bodies_are_where_the_rows_have_them(page, found, store):
    moved = False
    for place in found.panels:
        choose(page, place, BEST_RESPONSE)
        for k in range(len(found.extent.lams)):
            slide(page, "lam", k)
            for time in (0, 3, 8, 15):
                slide(page, "time", time)
                for side, row in zip(
                    SIDES, rows(found, store, place, BEST_RESPONSE, k), strict=True
                ):
                    assert np.abs(bodies(page, side) - means(row, time)).max() <= NEAR
                    left = page.locator(f"#{side} .body").evaluate_all(
                        "all => all.map(b => b.classList.contains('left'))"
                    )
                    assert left == [end is not None and end <= time for end in row.arrival]
                moved |= bool(np.abs(bodies(page, "selfish") - bodies(page, "social")).max() > 1)
    assert moved, "no two plans differ"


def test_it_opens_where_the_equilibrium_loses_most_safety(page, found):
    lost = shown(page, "selfish", "safety")[-1] - shown(page, "social", "safety")[-1]
    gaps = [panel.mean_gap(BEST_RESPONSE, "safety").max() for panel in found.panels.values()]
    assert lost == pytest.approx(max(gaps), rel=1e-4)
    assert lost > 0


def test_axes_are_labelled_where_their_lines_are(page):
    for side in SIDES:
        labels = page.locator(f"#{side} .grid text").all_text_contents()
        lines = page.locator(f"#{side} .grid line").evaluate_all(
            "all => all.map(l => l.x1.baseVal.value === l.x2.baseVal.value"
            " ? `x = ${l.x1.baseVal.value}` : `y = ${-l.y1.baseVal.value || 0}`)"
        )
        assert labels == lines
        assert {label[0] for label in labels} == {"x", "y"}
        assert len(labels) >= 6


def test_the_keyboard_is_enough(page, found):
    page.focus("[name=equilibrium]")
    page.keyboard.press("Tab")
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    expect(page.locator("[name=lamShown]")).to_have_text(f"λ = {found.extent.lams[1]:g}")
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    expect(page.locator("[name=play]")).to_have_text("Pause")
    page.keyboard.press("Tab")
    page.keyboard.press("End")
    expect(page.locator("[name=play]")).to_have_text("Play")
    gone = "all => all.every(b => b.classList.contains('left'))"
    assert page.locator(".side .body").evaluate_all(gone)


def test_play_moves_the_bodies_and_pauses(page):
    start = bodies(page, "social")
    page.click("[name=play]")
    expect(page.locator("[name=time]")).not_to_have_js_property("value", "0")
    page.click("[name=play]")
    paused = bodies(page, "social")
    assert np.abs(paused - start).max() > 1
    page.wait_for_timeout(200)
    assert np.array_equal(bodies(page, "social"), paused)
    assert page.locator("[name=play]").inner_text() == "Play"


def test_who_wants_no_motion_sees_whole_steps(browser, report, found):
    options = {"reduced_motion": "reduce", "viewport": {"width": 1200, "height": 900}}
    place = next(iter(found.panels))
    with reading(browser, report, **options) as page:
        choose(page, place, BEST_RESPONSE)
        slide(page, "lam", 0)
        row = found.panels[place].plans[SOCIAL][0]
        page.click("[name=play]")
        seen = page.evaluate(
            """() => new Promise((done) => {
                const seen = [];
                const look = () => {
                    const body = document.querySelector("#social .body").dataset;
                    seen.push([Number(body.x), Number(body.y)]);
                    if (seen.length < 60) requestAnimationFrame(look); else done(seen);
                };
                look();
            })"""
        )
        steps = np.array(row.means[0])
        apart = np.abs(np.array(seen)[:, None] - steps).max(axis=2).min(axis=1)
        assert apart.max() <= NEAR


def test_claims_have_their_verdicts_and_cases(page, found):
    claims = page.locator("tbody.claim")
    assert claims.count() == len(found.findings)
    for k, one in enumerate(found.findings):
        line = claims.nth(k)
        cells = line.locator("> tr:first-child > td").all_inner_texts()
        assert cells[:3] == [one.claim.key, one.claim.text, one.claim.source]
        assert cells[3].split(" ", 1)[1] == str(one.verdict)
        assert cells[4] == f"{one.verdict.holding}/{one.verdict.total}"
        cases = line.locator("details tbody tr")
        assert cases.count() == one.verdict.total
        assert cases.locator(".holds").count() == one.verdict.holding
        assert not one.cases or cases.locator("a").count() >= one.verdict.total


@pytest.mark.parametrize(
    ("rule", "event"), [("instants", "at the time steps"), ("swept", "during the steps")]
)
def test_the_page_and_its_figures_say_what_a_crash_is(found, rule, event):
    named = replace(found, extent=replace(found.extent, collisions=rule))
    text = whole_page(named)
    numbers = text.index('id="numbers"')
    assert f"A crash is an overlap {event}." in text[: text.index("<main>")]
    assert f"any overlap {event}" in " ".join(text[numbers:].split())
    assert embedded(json.dumps({"event": f"overlap {event}"}))[1:-1] in text
    for panels in found.sheets.values():
        figure = draw(panels, named.extent.crash_event)
        assert any(f"overlap {event}" in drawn.get_text() for drawn in figure.findobj(Text))


def test_the_command_on_the_page_makes_the_page(ppg, report, store, tmp_path):
    text = report.read_text(encoding="utf-8")
    (command,) = re.findall("<pre><code>(.*?)</code></pre>", text)
    program, *words = shlex.split(unescape(command))
    assert program == "ppg"
    again = tmp_path / "again.html"
    ppg(*words, "--store", store, "--out", again)
    assert again.read_bytes() == report.read_bytes()


def test_links_lead_somewhere(page):
    lost = page.evaluate(
        """() => [...document.querySelectorAll("a")].map((a) => a.getAttribute("href"))
            .filter((to) => !to.startsWith("#") || !document.getElementById(to.slice(1)))"""
    )
    assert lost == []


def test_every_figure_is_drawn_and_described(page):
    drawn = page.locator("figure img").evaluate_all(
        "all => all.map(i => i.complete && i.naturalWidth > 0 && i.alt.length > 40)"
    )
    assert drawn == [True, True]


@pytest.mark.parametrize("width", [360, 800, 1400])
def test_the_page_is_no_wider_than_the_screen(browser, report, width):
    with reading(browser, report, viewport={"width": width, "height": 700}) as page:
        page.locator("details").evaluate_all("all => all.forEach(d => { d.open = true; })")
        expect(page.locator("tbody.claim details p").first).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_cell_without_result_says_why(browser, found, tmp_path):
    reason = "stopped </script><b>early</b> & left nothing"
    place = next(iter(found.panels))
    plans = dict(found.panels[place].plans)
    nothing = dict.fromkeys(("arrival", "means", "shifted_cost", "deficit", "regret"))
    first, *others = plans[BEST_RESPONSE]
    failed = replace(first, status="failed", reason=reason, crash_probability=None, **nothing)
    plans[BEST_RESPONSE] = [failed, *others]
    panels = found.panels | {place: make_panel(place, found.extent.lams, plans)}
    path = tmp_path / "failed.html"
    write_page(Reproduction(found.extent, panels, judge_claims(panels)), str(path))
    with reading(browser, path) as page:
        choose(page, place, BEST_RESPONSE)
        slide(page, "lam", 0)
        assert page.locator("#selfish .reason").inner_text() == f"No plan: {reason}."
        assert not page.locator("#selfish svg").is_visible()
        assert page.locator("#social svg").is_visible()
        assert reason in page.locator("#failures li").inner_text()
        slide(page, "lam", 1)
        assert not page.locator("#selfish .reason").is_visible()
        assert page.locator("#selfish svg").is_visible()


def test_embedded_data_cannot_end_their_element():
    data = {"text": "</script><!--<script>"}
    text = embedded(json.dumps(data))
    assert not re.search("[<]", text)
    assert json.loads(text) == data
