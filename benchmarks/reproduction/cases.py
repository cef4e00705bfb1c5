"""Cases: the panels, equilibria and values of lam in which a claim is tested."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from benchmarks.reproduction.criteria import DIFFERENT, MIDDLE, Criterion
from benchmarks.reproduction.curves import Panel
from benchmarks.reproduction.extent import EQUILIBRIA, INTERSECTIONS, Place
from benchmarks.reproduction.verdicts import Case

Panels = Mapping[Place, Panel]
Cases = Callable[[Panels], Iterator[Case]]
"""The cases of a claim in all panels."""


def per_curve(criterion: Criterion, equilibria: Sequence[str] = EQUILIBRIA) -> Cases:
    """Return a case for each panel and equilibrium, over all lam."""

    def cases(panels: Panels) -> Iterator[Case]:
        for place, panel in panels.items():
            for name in equilibria:
                solved = _solved(panel, name)
                if solved.any() and (outcome := criterion(panel, name, solved)):
                    yield Case(_factors(place, name), *outcome)

    return cases


def per_half(criterion: Criterion) -> Cases:
    """Return a case for each panel, equilibrium, and low and high lam."""

    def cases(panels: Panels) -> Iterator[Case]:
        for place, panel in panels.items():
            high = panel.lams > MIDDLE
            for name in EQUILIBRIA:
                for half, mask in (("low", ~high), ("high", high)):
                    mask = mask & _solved(panel, name)
                    if mask.any() and (outcome := criterion(panel, name, mask)):
                        yield Case(_factors(place, name) | {"lam": half}, *outcome)

    return cases


def at_intersections(cases: Cases) -> Cases:
    """Restrict ``cases`` to the intersections."""
    return lambda panels: cases(
        {place: panel for place, panel in panels.items() if place.scenario in INTERSECTIONS}
    )


def first_two_against_intersections(panels: Panels) -> Iterator[Case]:
    """Compare the largest safety gaps of the first two scenarios with those of intersections."""
    for place, panel in panels.items():
        if place.scenario not in ("opposing", "head_on"):
            continue
        others = {
            scenario: panels.get(Place(place.setting, scenario, place.gain))
            for scenario in ("parallel", *INTERSECTIONS)
        }
        if None in others.values():
            continue
        for name in EQUILIBRIA:
            chosen = {place.scenario: panel} | {s: p for s, p in others.items() if p is not None}
            peak = {s: float(np.nanmax(p.mean_gap(name, "safety"))) for s, p in chosen.items()}
            first = min(peak[place.scenario], peak["parallel"])
            rest = max(peak[scenario] for scenario in INTERSECTIONS)
            listed = ", ".join(f"{scenario} {gap:.2f}" for scenario, gap in peak.items())
            yield Case(_factors(place, name), first > rest + DIFFERENT, f"largest gaps: {listed}")


def feedback_against_none(*, intersections: bool, high_only: bool, closer: bool) -> Cases:
    """Compare the safety gap with K = 0.5 and with K = 0, lam by lam.

    Parameters
    ----------
    intersections
        Use the intersections, or the first two scenarios.
    high_only
        Use high lam only.
    closer
        Claim that the gap is smaller with feedback, or that it is larger.
    """

    def cases(panels: Panels) -> Iterator[Case]:
        for place, panel in panels.items():
            twin = panels.get(Place(place.setting, place.scenario, 0.5))
            relevant = (place.scenario in INTERSECTIONS) == intersections
            if place.gain != 0.0 or twin is None or not relevant:
                continue
            at = panel.lams > MIDDLE if high_only else np.ones(len(panel.lams), dtype=bool)
            for name in EQUILIBRIA:
                both = at & _solved(panel, name) & _solved(twin, name)
                if not both.any():
                    continue
                without = np.abs(panel.mean_gap(name, "safety"))[both]
                feedback = np.abs(twin.mean_gap(name, "safety"))[both]
                less = int((feedback < without - DIFFERENT).sum())
                more = int((feedback > without + DIFFERENT).sum())
                factors = _factors(place, name)
                del factors["K"]
                yield Case(
                    factors,
                    less > more if closer else more > less,
                    f"gap smaller with feedback at {less}, larger at {more} of {len(without)} lam",
                )

    return cases


def _solved(panel: Panel, name: str) -> np.ndarray:
    """(L,) where both the equilibrium and the optimum have a result."""
    solved: np.ndarray = ~np.isnan(panel.mean_gap(name, "objective"))
    return solved


def _factors(place: Place, equilibrium: str) -> dict[str, str]:
    return {
        "speed": place.setting.speed,
        "M'": f"{place.setting.margin_cap:g}",
        "scenario": place.scenario,
        "K": f"{place.gain:g}",
        "equilibrium": equilibrium,
    }
