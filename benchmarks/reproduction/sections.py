"""Sections of the report as HTML: claims with their cases, figures, numbers, provenance.

All text from data passes through :func:`html.escape`.
"""

from __future__ import annotations

import platform
import shlex
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from benchmarks.figures import svg
from benchmarks.reproduction.curves import Curve, Panel
from benchmarks.reproduction.pictures import draw
from benchmarks.reproduction.run import Finding, Reproduction, Sheet
from benchmarks.reproduction.verdicts import DEPENDS, FAILS, HOLDS, OPEN, Case
from benchmarks.terminal import probability
from ppg_env.support.statistics import Interval

PACKAGES = ("path-planning-games", "numpy", "scipy", "highspy", "numba", "matplotlib")
"""Packages whose versions affect numbers and figures."""

SIGNS = {HOLDS: "✓", FAILS: "✗", DEPENDS: "±", OPEN: "&ndash;"}
"""Shown next to the colour, for readers who do not see it."""

CLASSES = {HOLDS: "holds", FAILS: "fails", DEPENDS: "depends", OPEN: "open"}


def claims(reproduction: Reproduction) -> str:
    """Return the table of claims, each with its definition and all its cases."""
    sheets = list(reproduction.sheets)
    return "\n".join(_claim(finding, sheets) for finding in reproduction.findings)


def _claim(finding: Finding, sheets: Sequence[Sheet]) -> str:
    claim, verdict = finding.claim, finding.verdict
    rest = str(verdict).removeprefix(verdict.word)
    cells = [
        ("Claim", f"<strong>{escape(claim.key)}</strong>"),
        ("Claim of the paper", escape(claim.text)),
        ("Source", escape(claim.source)),
        ("Verdict", _badge(verdict.word) + escape(rest)),
        ("Cases that hold", f"{verdict.holding}/{verdict.total}"),
    ]
    line = "".join(f'<td data-label="{label}">{cell}</td>' for label, cell in cells)
    return (
        f'<tbody class="claim"><tr>{line}</tr><tr><td colspan="{len(cells)}"><details>'
        f"<summary>Definition and {verdict.total} cases</summary>"
        f"<p>Holds in a case if {escape(claim.definition)}.</p>{_cases(finding, sheets)}"
        "</details></td></tr></tbody>"
    )


def _cases(finding: Finding, sheets: Sequence[Sheet]) -> str:
    if not finding.cases:
        return "<p>No cell that was run concerns this claim.</p>"
    factors = list(dict.fromkeys(name for case in finding.cases for name in case.factors))
    rows = [
        [escape(case.factors.get(name, "")) for name in factors]
        + [_badge(HOLDS if case.holds else FAILS), escape(case.evidence), _links(case, sheets)]
        for case in finding.cases
    ]
    return _table(
        f"Cases of: {finding.claim.key}", [*factors, "outcome", "evidence", "figure"], rows
    )


def _links(case: Case, sheets: Sequence[Sheet]) -> str:
    """Return links to the figures of a case; a case about feedback has two, with and without."""
    return " ".join(
        f'<a href="#{_anchor((setting, gain))}">K = {gain:g}</a>'
        for setting, gain in sheets
        if case.factors["speed"] == setting.speed
        and case.factors["M'"] == f"{setting.margin_cap:g}"
        and case.factors.get("K", f"{gain:g}") == f"{gain:g}"
    )


def _badge(word: str) -> str:
    return f'<span class="badge {CLASSES[word]}">{SIGNS[word]} {word}</span>'


def figures(reproduction: Reproduction) -> str:
    """Return one figure per setting and gain."""
    event = reproduction.extent.crash_event
    return "\n".join(_figure(sheet, own, event) for sheet, own in reproduction.sheets.items())


def _figure(sheet: Sheet, panels: Sequence[Panel], event: str) -> str:
    scenarios = ", ".join(panel.place.scenario for panel in panels)
    text = (
        "Objective, time to goal, safety lost and crash probability over lam, at equilibria and at "
        f"the social optimum, for {_name(sheet)}. A crash is an {event}. A row of panels per "
        f"scenario: {scenarios}. The numbers are in the tables below."
    )
    image = b64encode(svg(draw(panels, event))).decode("ascii")
    return (
        f'<figure id="{_anchor(sheet)}"><figcaption>{escape(_name(sheet))}</figcaption>'
        + _scroller(
            f"Figure, {_name(sheet)}",
            f'<img src="data:image/svg+xml;base64,{image}" alt="{escape(text)}">',
        )
        + "</figure>"
    )


def numbers(reproduction: Reproduction) -> str:
    """Return one table per panel: every solution at every lam, averages and each agent."""
    return "\n".join(_numbers(panel) for panel in reproduction.panels.values())


COLUMNS = (
    "lam", "solution", "status", "objective", "time", "safety lost", "crash probability",
    "union bound", "regret",
)  # fmt: skip


def _numbers(panel: Panel) -> str:
    rows = [
        [f"{lam:g}", escape(name), escape(curve.status[k]), *_values(curve, k)]
        for k, lam in enumerate(panel.lams)
        for name, curve in panel.curves.items()
    ]
    name = f"{panel.place.scenario}, {_name((panel.place.setting, panel.place.gain))}"
    return f"<details><summary>{escape(name)}</summary>{_table(name, COLUMNS, rows)}</details>"


def _values(curve: Curve, k: int) -> list[str]:
    if curve.reasons[k]:
        return [escape(curve.reasons[k]), *[""] * 5]
    averages = [
        f"{values[k].mean():.4g} ({', '.join(f'{value:.4g}' for value in values[k])})"
        for values in (curve.objective, curve.time, curve.safety)
    ]
    crash = escape(probability(Interval(*curve.crash[k])))
    return [*averages, crash, _power(curve.risk_bound[k]), _power(curve.regret[k])]


def _power(value: float) -> str:
    return "&ndash;" if np.isnan(value) else f"{value:.1e}" if value else "0"


def failures(reproduction: Reproduction) -> str:
    """Return the list of cells without a result, with reasons."""
    if not reproduction.failed:
        return "<p>Every cell has a result.</p>"
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in reproduction.failed)
    return f"<p>{len(reproduction.failed)} cells have no result:</p><ul>{items}</ul>"


def making(reproduction: Reproduction) -> str:
    """Return the command, and the versions of the packages."""
    extent = reproduction.extent
    values = {
        "settings": ",".join(f"{s.speed}:{s.margin_cap:g}" for s in extent.settings),
        "scenarios": ",".join(extent.scenarios),
        "lams": ",".join(f"{lam:g}" for lam in extent.lams),
        "episodes": str(extent.episodes),
        "seed": str(extent.seed),
        "collisions": extent.collisions,
    }
    options = [word for name, value in values.items() for word in (f"--{name}", value)]
    command = shlex.join(["ppg", "reproduce", *options])
    used = [f"Python {platform.python_version()}", *map(_version, PACKAGES)]
    return (
        f"<pre><code>{escape(command)}</code></pre>"
        f"<p>{extent.size} cells, {extent.episodes} simulated episodes each, seed {extent.seed}. "
        f"This page was written with {escape(', '.join(used))}; cells stored earlier may have been "
        "run with other versions.</p>"
    )


def _version(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:  # run from a folder without installation
        return f"{package} (not installed)"


def _anchor(sheet: Sheet) -> str:
    setting, gain = sheet
    return f"figure-{setting.speed}-{setting.margin_cap:g}-{gain:g}"


def _name(sheet: Sheet) -> str:
    setting, gain = sheet
    return f"{setting}, K = {gain:g}"


def _table(name: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a scrollable table; ``rows`` are HTML."""
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return _scroller(name, table)


def _scroller(name: str, content: str) -> str:
    """Return ``content`` in a region that scrolls, also with the keyboard."""
    label = escape(name)
    return f'<div class="wide" role="region" aria-label="{label}" tabindex="0">{content}</div>'
