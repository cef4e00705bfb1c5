r"""The claims of the paper, each with a definition that can fail.

X^N and X^S are a quantity at an equilibrium and at the social optimum, averaged over the agents;
the gap is X^N - X^S.  :mod:`benchmarks.reproduction.cases` lists the cases of a claim,
:mod:`benchmarks.reproduction.criteria` decides each of them, and
:mod:`benchmarks.reproduction.verdicts` summarises them.
"""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.reproduction.cases import (
    Cases,
    at_intersections,
    feedback_against_none,
    first_two_against_intersections,
    per_curve,
    per_half,
)
from benchmarks.reproduction.criteria import (
    SMALL,
    converges,
    gap_of_sign,
    more_crashes,
    safety_gap_trend,
    same_sign_for_all_agents,
    small_cost_gap,
)
from benchmarks.reproduction.extent import DYNAMICS
from benchmarks.studies.results import NEGLIGIBLE
from ppg_env import tolerances as tol


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes
    ----------
    key : short name.
    text : the claim.
    source : the place in the paper.
    definition : what holds in each case if the claim is true.
    cases : the cases of the claim in all panels.
    """

    key: str
    text: str
    source: str
    definition: str
    cases: Cases


CLAIMS = (
    Claim(
        "small objective gap",
        "Equilibria cost about as much as the social optimum.",
        "Experiments, column (a)",
        f"(J^N - J^S) / J^S <= {SMALL:.0%} at every lam of the half, on shifted costs",
        per_half(small_cost_gap),
    ),
    Claim(
        "equilibria are faster",
        "Selfish agents reach their goals sooner.",
        "Experiments, column (b)",
        "T^N < T^S at some lam of the half and T^N > T^S at none",
        per_half(gap_of_sign("time", -1.0)),
    ),
    Claim(
        "safety is compromised",
        "Selfish agents keep smaller margins.",
        "Experiments, column (c)",
        "the sum of M' - s is larger at equilibrium at some lam of the half and smaller at none",
        per_half(gap_of_sign("safety", 1.0)),
    ),
    Claim(
        "more collisions",
        "Equilibria have significantly more collisions.",
        "Introduction",
        "the 95 % interval of the crash probability lies above the optimum's at some lam of the "
        f"half and below it at none; values below {NEGLIGIBLE:g} count as {NEGLIGIBLE:g}",
        per_half(more_crashes),
    ),
    Claim(
        "gap grows with care",
        "The gap in safety grows with the weight of safety.",
        "Introduction",
        "the mean safety gap at lam <= 0.5 exceeds the one at lam > 0.5",
        per_curve(safety_gap_trend(-1.0)),
    ),
    Claim(
        "dramatic in the first two",
        "The safety gap is largest in the opposing and the parallel scenario.",
        "Experiments",
        "the largest safety gaps over lam of both exceed those of both intersections",
        first_two_against_intersections,
    ),
    Claim(
        "elsewhere at high lam",
        "In the intersections the safety gap is larger for high lam.",
        "Experiments",
        "the mean safety gap at lam > 0.5 exceeds the one at lam <= 0.5",
        at_intersections(per_curve(safety_gap_trend(1.0))),
    ),
    Claim(
        "feedback helps",
        "With feedback, equilibria are closer to the optimum in safety.",
        "Experiments",
        "in the first two scenarios: the safety gap is smaller with K = 0.5 than with K = 0 at "
        "more lam than it is larger",
        feedback_against_none(intersections=False, high_only=False, closer=True),
    ),
    Claim(
        "feedback helps at intersections",
        "At intersections, too, for most lam.",
        "Experiments",
        "in the intersections: the safety gap is smaller with K = 0.5 than with K = 0 at more "
        "lam than it is larger",
        feedback_against_none(intersections=True, high_only=False, closer=True),
    ),
    Claim(
        "except at high lam",
        "At intersections with high lam, the gap is larger with feedback.",
        "Experiments",
        "in the intersections, at lam > 0.5: the gap is larger with K = 0.5 at more lam than it "
        "is smaller",
        feedback_against_none(intersections=True, high_only=True, closer=False),
    ),
    Claim(
        "same for each agent",
        "The observations are similar for each agent.",
        "Experiments",
        "at no lam does any agent's gap in time or safety have the other sign than the average's",
        per_curve(same_sign_for_all_agents),
    ),
    Claim(
        "best response converges",
        "Best-response dynamics end at an equilibrium.",
        "Finding equilibria",
        f"at every lam no agent can gain more than {tol.EQUILIBRIUM:g}, by certificate",
        per_curve(converges, tuple(DYNAMICS)),
    ),
)
