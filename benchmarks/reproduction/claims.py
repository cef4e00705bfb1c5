r"""What the paper says of its experiments, each claim with a definition that can fail.

X^N and X^S are a quantity at an equilibrium and at the social optimum, averaged over the agents;
its gap is X^N - X^S.  A claim yields one :class:`Case` for each place it speaks about, setting by
setting and equilibrium by equilibrium; :mod:`benchmarks.reproduction.verdicts` sums them up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.reproduction.curves import Panel
from benchmarks.reproduction.extent import DYNAMICS, EQUILIBRIA, INTERSECTIONS, Place
from benchmarks.reproduction.verdicts import Case
from benchmarks.studies.results import FREE, NEGLIGIBLE
from ppg_env import tolerances as tol

SMALL = 0.10
"""A gap in cost up to this share of the optimum's cost counts as small."""

MIDDLE = 0.5
"""Values of lam up to this one are low, those above are high."""

DIFFERENT = 1e-3
"""Costs, times and sums of margins that differ by less count as equal: plans are exact to about
1e-6 in cost, but agents indifferent between two plans may split a sum otherwise."""

Panels = Mapping[Place, Panel]


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes
    ----------
    key : short name.
    text : what is claimed.
    source : where the paper says so.
    definition : what holds in each case if the claim is true.
    cases : the cases of all panels.
    """

    key: str
    text: str
    source: str
    definition: str
    cases: Callable[[Panels], Iterator[Case]]


Test = Callable[[Panel, str, np.ndarray], tuple[bool, str] | None]
"""Outcome and evidence in a panel, for an equilibrium, at some values of lam (a mask); None if
there is no data."""


def _each_curve(test: Test, equilibria: Sequence[str] = EQUILIBRIA) -> Callable:
    """Cases by panel and equilibrium, over all lam."""

    def cases(panels: Panels) -> Iterator[Case]:
        for place, panel in panels.items():
            for name in equilibria:
                known = _known(panel, name)
                if known.any() and (found := test(panel, name, known)):
                    yield Case(_factors(place, name), *found)

    return cases


def _each_half(test: Test) -> Callable:
    """Cases by panel, equilibrium, and low and high lam."""

    def cases(panels: Panels) -> Iterator[Case]:
        for place, panel in panels.items():
            high = panel.lams > MIDDLE
            for name in EQUILIBRIA:
                for half, mask in (("low", ~high), ("high", high)):
                    mask = mask & _known(panel, name)
                    if mask.any() and (found := test(panel, name, mask)):
                        yield Case(_factors(place, name) | {"lam": half}, *found)

    return cases


def _known(panel: Panel, name: str) -> np.ndarray:
    """(L,) where both the equilibrium and the optimum have a result."""
    known: np.ndarray = ~np.isnan(panel.mean_gap(name, "objective"))
    return known


def _factors(place: Place, equilibrium: str | None = None) -> dict[str, str]:
    found = {
        "speed": place.setting.speed,
        "M'": f"{place.setting.margin_cap:g}",
        "scenario": place.scenario,
        "K": f"{place.gain:g}",
    }
    return found if equilibrium is None else found | {"equilibrium": equilibrium}


def _small(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    base = np.maximum(panel.social.mean("objective")[at], FREE)
    share = panel.mean_gap(name, "objective")[at] / base
    k = int(share.argmax())
    shown = max(share[k], 0.0)  # rounding may put a plan below the optimum by 1e-16
    return bool(share[k] <= SMALL), f"largest gap {shown:.1%} at lam {panel.lams[at][k]:g}"


def _lower(quantity: str, sign: float) -> Test:
    """The gap has the ``sign`` somewhere, and the other one nowhere."""

    def test(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
        gap = panel.mean_gap(name, quantity)[at]
        right, wrong = sign * gap > DIFFERENT, sign * gap < -DIFFERENT
        k = int(np.abs(gap).argmax())
        said = f"as claimed at {right.sum()} of {len(gap)} lam, opposite at {wrong.sum()}"
        return (
            bool(right.any() and not wrong.any()),
            f"{said}; largest gap {gap[k]:+.2f} at lam {panel.lams[at][k]:g}",
        )

    return test


def _crashes(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    above = np.maximum(panel.curves[name].crash[at], NEGLIGIBLE)
    below = np.maximum(panel.social.crash[at], NEGLIGIBLE)
    more, less = above[:, 1] > below[:, 2], above[:, 2] < below[:, 1]
    k = int(np.argmax(above[:, 1] - below[:, 2]))
    return (
        bool(more.any() and not less.any()),
        f"more beyond doubt at {more.sum()} of {len(more)} lam, fewer at {less.sum()}; "
        f"{above[k, 0]:.1e} against {below[k, 0]:.1e} at lam {panel.lams[at][k]:g}",
    )


def _rising(sign: float) -> Test:
    """The mean safety gap at high lam exceeds the one at low lam (or the reverse)."""

    def test(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str] | None:
        gap, lams = panel.mean_gap(name, "safety")[at], panel.lams[at]
        low, high = gap[lams <= MIDDLE], gap[lams > MIDDLE]
        if not (len(low) and len(high)):
            return None
        return (
            bool(sign * (high.mean() - low.mean()) > DIFFERENT),
            f"mean gap {low.mean():.2f} at low lam, {high.mean():.2f} at high lam",
        )

    return test


def _alike(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    worst, where = 0.0, ""
    for quantity in ("time", "safety"):
        gaps, mean = panel.gap(name, quantity)[at], panel.mean_gap(name, quantity)[at]
        against = np.where(np.abs(mean) > DIFFERENT, -np.sign(mean), 0.0)[:, None] * gaps
        if against.max() > max(worst, DIFFERENT):
            k = int(against.max(axis=1).argmax())
            worst = float(against.max())
            where = f"{quantity} of an agent differs by {worst:.2f} the other way"
            where += f" at lam {panel.lams[at][k]:g}"
    return not where, where or "no agent's gap has the other sign"


def _converges(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    curve = panel.curves[name]
    worst = float(np.nanmax(curve.regret[at]))
    ended = [word for word, reason in zip(curve.status, curve.reasons, strict=True)]
    good = all(word == "equilibrium" for word in ended) and worst <= tol.EQUILIBRIUM
    odd = sorted({word for word in ended if word != "equilibrium"})
    return good, f"largest certified regret {worst:.0e}" + (f"; {', '.join(odd)}" if odd else "")


def _dramatic(panels: Panels) -> Iterator[Case]:
    """Both of the first two scenarios against both intersections."""
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
            found = {place.scenario: panel} | {s: p for s, p in others.items() if p is not None}
            peak = {s: float(np.nanmax(p.mean_gap(name, "safety"))) for s, p in found.items()}
            first = min(peak[place.scenario], peak["parallel"])
            rest = max(peak[scenario] for scenario in INTERSECTIONS)
            told = ", ".join(f"{scenario} {gap:.2f}" for scenario, gap in peak.items())
            yield Case(_factors(place, name), first > rest + DIFFERENT, f"largest gaps: {told}")


def _with_feedback(
    scenarios: Callable[[str], bool], high_only: bool, closer: bool
) -> Callable[[Panels], Iterator[Case]]:
    """The safety gap with K = 0.5 against the one with K = 0, lam by lam."""

    def cases(panels: Panels) -> Iterator[Case]:
        for place, panel in panels.items():
            twin = panels.get(Place(place.setting, place.scenario, 0.5))
            if place.gain != 0.0 or twin is None or not scenarios(place.scenario):
                continue
            at = panel.lams > MIDDLE if high_only else np.ones(len(panel.lams), dtype=bool)
            for name in EQUILIBRIA:
                both = at & _known(panel, name) & _known(twin, name)
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


CLAIMS = (
    Claim(
        "small objective gap",
        "Equilibria cost about as much as the optimum.",
        "Experiments, column (a)",
        f"(J^N - J^S) / J^S <= {SMALL:.0%} at every lam of the half, on shifted costs",
        _each_half(_small),
    ),
    Claim(
        "equilibria are faster",
        "Selfish agents reach their goals sooner.",
        "Experiments, column (b)",
        "T^N < T^S at some lam of the half and T^N > T^S at none",
        _each_half(_lower("time", -1.0)),
    ),
    Claim(
        "safety is compromised",
        "Selfish agents keep smaller margins.",
        "Experiments, column (c)",
        "the sum of M' - s is larger at equilibrium at some lam of the half and smaller at none",
        _each_half(_lower("safety", 1.0)),
    ),
    Claim(
        "more collisions",
        "Equilibria have significantly more collisions.",
        "Introduction",
        "the 95 % interval of the crash probability lies above the optimum's at some lam of the "
        f"half and below it at none; what is below {NEGLIGIBLE:g} counts as {NEGLIGIBLE:g}",
        _each_half(_crashes),
    ),
    Claim(
        "gap grows with care",
        "As safety matters more, the gap in safety opens up.",
        "Introduction",
        "the mean safety gap at lam <= 0.5 exceeds the one at lam > 0.5",
        _each_curve(_rising(-1.0)),
    ),
    Claim(
        "dramatic in the first two",
        "The safety gap is largest in the opposing and the parallel scenario.",
        "Experiments",
        "the largest safety gaps over lam of both exceed those of both intersections",
        _dramatic,
    ),
    Claim(
        "elsewhere at high lam",
        "In the intersections the safety gap is larger for high lam.",
        "Experiments",
        "the mean safety gap at lam > 0.5 exceeds the one at lam <= 0.5",
        lambda panels: _each_curve(_rising(1.0))(_of(panels, INTERSECTIONS)),
    ),
    Claim(
        "feedback helps",
        "With feedback, equilibria are closer to the optimum in safety.",
        "Experiments",
        "in the first two scenarios: the safety gap is smaller with K = 0.5 than with K = 0 at "
        "more lam than it is larger",
        _with_feedback(lambda scenario: scenario not in INTERSECTIONS, False, True),
    ),
    Claim(
        "feedback helps at intersections",
        "There, too, for most lam.",
        "Experiments",
        "the same in the intersections",
        _with_feedback(lambda scenario: scenario in INTERSECTIONS, False, True),
    ),
    Claim(
        "except at high lam",
        "But at intersections with high lam, the gap is larger with feedback.",
        "Experiments",
        "in the intersections, at lam > 0.5: the gap is larger with K = 0.5 at more lam than it "
        "is smaller",
        _with_feedback(lambda scenario: scenario in INTERSECTIONS, True, False),
    ),
    Claim(
        "same for each agent",
        "The observations are similar agent by agent.",
        "Experiments",
        "at no lam does any agent's gap in time or safety have the other sign than the average's",
        _each_curve(_alike),
    ),
    Claim(
        "best response converges",
        "Best-response dynamics end at an equilibrium.",
        "Finding equilibria",
        f"at every lam no agent can gain more than {tol.EQUILIBRIUM:g}, by certificate",
        _each_curve(_converges, tuple(DYNAMICS)),
    ),
)


def _of(panels: Panels, scenarios: Sequence[str]) -> Panels:
    return {place: panel for place, panel in panels.items() if place.scenario in scenarios}
