r"""Criteria: what must hold in a panel for a claim of the paper to be true there.

X^N and X^S are a quantity at an equilibrium and at the social optimum, averaged over the agents;
the gap is X^N - X^S.  A criterion gets a panel, the name of an equilibrium and a mask of values of
lam, and returns the outcome with its evidence.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.reproduction.curves import Panel
from benchmarks.studies.results import FREE, NEGLIGIBLE
from ppg_env import tolerances as tol

SMALL = 0.10
"""Gaps in cost up to this share of the optimum's cost count as small."""

MIDDLE = 0.5
"""Values of lam up to this one are low, larger ones are high."""

DIFFERENT = 1e-3
"""Costs, times and sums of margins that differ by less count as equal.  Plans are exact to about
1e-6 in cost, but agents that are indifferent between two plans may split a sum differently."""

Criterion = Callable[[Panel, str, np.ndarray], tuple[bool, str] | None]
"""Outcome and evidence in a panel, for an equilibrium, at the masked values of lam; None without
data."""


def small_cost_gap(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    """Test whether the gap in cost is small at every lam."""
    base = np.maximum(panel.social.mean("objective")[at], FREE)
    share = panel.mean_gap(name, "objective")[at] / base
    k = int(share.argmax())
    shown = max(share[k], 0.0)  # rounding may put a plan below the optimum by 1e-16
    return bool(share[k] <= SMALL), f"largest gap {shown:.1%} at lam {panel.lams[at][k]:g}"


def gap_of_sign(quantity: str, sign: float) -> Criterion:
    """Return the criterion that the gap has ``sign`` at some lam and the other sign at none."""

    def criterion(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
        gap = panel.mean_gap(name, quantity)[at]
        right, wrong = sign * gap > DIFFERENT, sign * gap < -DIFFERENT
        k = int(np.abs(gap).argmax())
        counts = f"as claimed at {right.sum()} of {len(gap)} lam, opposite at {wrong.sum()}"
        return (
            bool(right.any() and not wrong.any()),
            f"{counts}; largest gap {gap[k]:+.2f} at lam {panel.lams[at][k]:g}",
        )

    return criterion


def more_crashes(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    """Test whether crashes are significantly more likely at some lam and less likely at none."""
    above = np.maximum(panel.curves[name].crash[at], NEGLIGIBLE)
    below = np.maximum(panel.social.crash[at], NEGLIGIBLE)
    more, less = above[:, 1] > below[:, 2], above[:, 2] < below[:, 1]
    k = int(np.argmax(above[:, 1] - below[:, 2]))
    return (
        bool(more.any() and not less.any()),
        f"significantly more at {more.sum()} of {len(more)} lam, fewer at {less.sum()}; "
        f"{above[k, 0]:.1e} compared with {below[k, 0]:.1e} at lam {panel.lams[at][k]:g}",
    )


def safety_gap_trend(sign: float) -> Criterion:
    """Return the criterion that the mean safety gap is larger at high than at low lam.

    With ``sign`` -1, that it is larger at low lam.
    """

    def criterion(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str] | None:
        gap, lams = panel.mean_gap(name, "safety")[at], panel.lams[at]
        low, high = gap[lams <= MIDDLE], gap[lams > MIDDLE]
        if not (len(low) and len(high)):
            return None
        shown = f"mean gap {low.mean():.2f} at low lam, {high.mean():.2f} at high lam"
        return bool(sign * (high.mean() - low.mean()) > DIFFERENT), shown

    return criterion


def same_sign_for_all_agents(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    """Test whether no agent's gap in time or safety has the other sign than the average's."""
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


def converges(panel: Panel, name: str, at: np.ndarray) -> tuple[bool, str]:
    """Test whether the dynamics end at a certified equilibrium for every lam of the panel."""
    curve = panel.curves[name]
    worst = float(np.nanmax(curve.regret[at]))
    others = sorted(set(curve.status) - {"equilibrium"})
    holds = not others and worst <= tol.EQUILIBRIUM
    suffix = f"; {', '.join(others)}" if others else ""
    return holds, f"largest certified regret {worst:.0e}{suffix}"
