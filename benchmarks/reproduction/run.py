"""The whole reproduction: cells, panels, and the claims with their verdicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.reproduction.claims import CLAIMS, Claim
from benchmarks.reproduction.curves import QUANTITIES, Curve, Panel, make_panel
from benchmarks.reproduction.extent import Extent, Place, Setting
from benchmarks.reproduction.verdicts import Case, Verdict, verdict
from benchmarks.sweeps import sweep

Sheet = tuple[Setting, float]
"""Setting and gain: the panels that are drawn together."""


@dataclass(frozen=True)
class Finding:
    """A claim, its cases, and the verdict."""

    claim: Claim
    cases: Sequence[Case]
    verdict: Verdict


@dataclass(frozen=True)
class Reproduction:
    """Panels of an extent, and the findings on all claims."""

    extent: Extent
    panels: dict[Place, Panel]
    findings: list[Finding]

    @property
    def sheets(self) -> dict[Sheet, list[Panel]]:
        """Panels by setting and gain, in the order of the extent."""
        sheets: dict[Sheet, list[Panel]] = {}
        for panel in self.panels.values():
            sheets.setdefault((panel.place.setting, panel.place.gain), []).append(panel)
        return sheets

    @property
    def failed(self) -> list[str]:
        """Why cells have no result, one sentence each."""
        return [
            f"{place.scenario}, K = {place.gain:g}, {place.setting}, {name}: {reason}"
            for place, panel in self.panels.items()
            for name, curve in panel.curves.items()
            for reason in curve.reasons
            if reason
        ]


def reproduce(
    extent: Extent,
    store: str | Path,
    *,
    jobs: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Reproduction:
    """Run the cells that ``store`` lacks, and test the claims on all cells.

    ``progress`` is called with numbers of cells, as by :func:`benchmarks.sweeps.sweep`.
    """
    asked = {place: extent.cells(place) for place in extent.places()}
    cells = [cell for solutions in asked.values() for some in solutions.values() for cell in some]
    rows = iter(sweep(cells, store, jobs=jobs, progress=progress))
    panels = {}
    for place, solutions in asked.items():
        solved = {name: [next(rows) for _ in some] for name, some in solutions.items()}
        panels[place] = make_panel(place, extent.lams, solved)
    return Reproduction(extent, panels, judge_claims(panels))


def judge_claims(panels: dict[Place, Panel]) -> list[Finding]:
    """Return a finding for every claim."""
    findings = []
    for claim in CLAIMS:
        cases = list(claim.cases(panels))
        findings.append(Finding(claim, cases, verdict(cases)))
    return findings


def report(reproduction: Reproduction) -> dict[str, Any]:
    """Return the content of ``ppg reproduce --json``, from which the docs are generated."""
    extent = reproduction.extent
    return {
        "episodes": extent.episodes,
        "seed": extent.seed,
        "collisions": extent.collisions,
        "lam": list(extent.lams),
        "claims": [_claim(finding) for finding in reproduction.findings],
        "panels": [_panel(panel) for panel in reproduction.panels.values()],
        "failed": reproduction.failed,
    }


def _claim(finding: Finding) -> dict[str, Any]:
    claim, verdict = finding.claim, finding.verdict
    return {
        "key": claim.key,
        "text": claim.text,
        "source": claim.source,
        "definition": claim.definition,
        "verdict": str(verdict),
        "word": verdict.word,
        "holding": verdict.holding,
        "total": verdict.total,
        "on": verdict.on,
        "cases": [
            {**case.factors, "holds": case.holds, "evidence": case.evidence}
            for case in finding.cases
        ],
    }


def _panel(panel: Panel) -> dict[str, Any]:
    place = panel.place
    return {
        "speed": place.setting.speed,
        "margin_cap": place.setting.margin_cap,
        "scenario": place.scenario,
        "gain": place.gain,
        "curves": {name: _curve(curve) for name, curve in panel.curves.items()},
    }


def _curve(curve: Curve) -> dict[str, Any]:
    return {
        **{name: curve.mean(name) for name in QUANTITIES},
        "agents": {name: getattr(curve, name) for name in QUANTITIES},
        "crash_probability": curve.crash,
        "risk_bound": curve.risk_bound,
        "regret": curve.regret,
        "status": curve.status,
    }
