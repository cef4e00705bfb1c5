r"""Verdicts: the summary of the cases of a claim, and the factors that it depends on.

A claim is tested in many *cases*; each has a value of several *factors* (speed set, margin cap,
scenario, ...) and an outcome.  If all cases agree, the verdict is theirs.  Otherwise it names the
factors that explain most of the difference:

    explained(f) = sum over values v of f:  n_v (share_v - share)^2  /  (n share (1 - share))

where share is the fraction of cases in which the claim holds: the squared correlation ratio.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

HOLDS, FAILS, DEPENDS, OPEN = "holds", "fails", "depends", "no data"

NOTABLE = 0.05
"""Factors that explain less than this are not named."""

MOST_NAMED = 2
"""Largest number of factors named."""


@dataclass(frozen=True)
class Case:
    """One test of a claim.

    Attributes
    ----------
    factors : the value of each factor.
    holds : the outcome.
    evidence : the numbers behind the outcome, as a phrase.
    """

    factors: Mapping[str, str]
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Verdict:
    """The summary of all cases of a claim.

    Attributes
    ----------
    word : ``holds``, ``fails``, ``depends`` or ``no data``.
    holding, total : numbers of cases.
    on : for each factor that it depends on and each of its values, the number of cases that hold,
        and of all cases.
    """

    word: str
    holding: int
    total: int
    on: Mapping[str, Mapping[str, tuple[int, int]]]

    def __str__(self) -> str:
        if self.word != DEPENDS:
            return self.word
        if not self.on:
            return "depends, on no single factor"
        return "depends on " + " and ".join(
            f"{factor} (" + ", ".join(f"{v}: {a}/{n}" for v, (a, n) in shares.items()) + ")"
            for factor, shares in self.on.items()
        )


def verdict(cases: Sequence[Case]) -> Verdict:
    """Return the verdict of ``cases``."""
    total, holding = len(cases), sum(case.holds for case in cases)
    if holding in (0, total):
        word = OPEN if not total else HOLDS if holding else FAILS
        return Verdict(word, holding, total, {})
    factors = dict.fromkeys(name for case in cases for name in case.factors)
    shares = {factor: _shares(cases, factor) for factor in factors}
    # The sort is stable: ties keep the order of the factors.
    ranked = sorted(factors, key=lambda factor: -_explained(shares[factor]))
    named = [factor for factor in ranked[:MOST_NAMED] if _explained(shares[factor]) >= NOTABLE]
    return Verdict(DEPENDS, holding, total, {factor: shares[factor] for factor in named})


def _shares(cases: Sequence[Case], factor: str) -> dict[str, tuple[int, int]]:
    """Return, for each value of a factor, the number of cases that hold and of all cases."""
    values = dict.fromkeys(case.factors[factor] for case in cases if factor in case.factors)
    outcomes = {v: [c.holds for c in cases if c.factors.get(factor) == v] for v in values}
    return {v: (sum(held), len(held)) for v, held in outcomes.items()}


def _explained(shares: Mapping[str, tuple[int, int]]) -> float:
    total = sum(n for _, n in shares.values())
    share = sum(a for a, _ in shares.values()) / total
    if share in (0.0, 1.0):
        return 0.0
    between = sum(n * (a / n - share) ** 2 for a, n in shares.values())
    return between / (total * share * (1 - share))
