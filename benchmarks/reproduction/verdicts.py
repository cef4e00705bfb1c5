r"""From cases to a verdict, and to what it depends on.

A claim is put to many *cases*; each has a place on several *factors* (speed set, margin cap,
scenario, ...) and an outcome.  If all cases agree, so does the verdict.  Otherwise the factor that
explains most of the difference is named:

    explained(f) = sum over values v of f:  n_v (share_v - share)^2  /  (n share (1 - share))

with share the part of cases in which the claim holds: the squared correlation ratio.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

HOLDS, FAILS, DEPENDS, OPEN = "holds", "fails", "depends", "no data"

TELLING = 0.05
"""A factor that explains less than this is not named."""

MOST_NAMED = 2
"""Factors named at most."""


@dataclass(frozen=True)
class Case:
    """One test of a claim.

    Attributes
    ----------
    factors : where it stands, in words.
    holds : the outcome.
    evidence : the numbers it rests on.
    """

    factors: Mapping[str, str]
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Verdict:
    """What the cases say together.

    Attributes
    ----------
    word : ``holds``, ``fails``, ``depends`` or ``no data``.
    holding, total : numbers of cases.
    on : what it depends on: per factor, the share of cases that hold for each of its values.
    """

    word: str
    holding: int
    total: int
    on: Mapping[str, Mapping[str, tuple[int, int]]]

    def __str__(self) -> str:
        if self.word != DEPENDS:
            return self.word
        if not self.on:
            return "depends, on nothing that was varied alone"
        return "depends on " + " and ".join(
            f"{factor} (" + ", ".join(f"{v}: {a}/{n}" for v, (a, n) in shares.items()) + ")"
            for factor, shares in self.on.items()
        )


def verdict(cases: Sequence[Case]) -> Verdict:
    """The verdict of ``cases``."""
    total, holding = len(cases), sum(case.holds for case in cases)
    if holding in (0, total):
        word = OPEN if not total else HOLDS if holding else FAILS
        return Verdict(word, holding, total, {})
    factors = dict.fromkeys(name for case in cases for name in case.factors)
    shares = {factor: _shares(cases, factor) for factor in factors}
    ranked = sorted(
        factors, key=lambda factor: -_explained(shares[factor])
    )  # stable: ties by order
    named = [factor for factor in ranked[:MOST_NAMED] if _explained(shares[factor]) >= TELLING]
    return Verdict(DEPENDS, holding, total, {factor: shares[factor] for factor in named})


def _shares(cases: Sequence[Case], factor: str) -> dict[str, tuple[int, int]]:
    """Per value of a factor: cases that hold, and all."""
    values = dict.fromkeys(case.factors[factor] for case in cases if factor in case.factors)
    mine = {v: [case.holds for case in cases if case.factors.get(factor) == v] for v in values}
    return {v: (sum(found), len(found)) for v, found in mine.items()}


def _explained(shares: Mapping[str, tuple[int, int]]) -> float:
    total = sum(n for _, n in shares.values())
    share = sum(a for a, _ in shares.values()) / total
    if share in (0.0, 1.0):
        return 0.0
    between = sum(n * (a / n - share) ** 2 for a, n in shares.values())
    return between / (total * share * (1 - share))
