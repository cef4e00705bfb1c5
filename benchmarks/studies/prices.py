r"""Ratios of cost and risk between an equilibrium and the social optimum of the same game.

    cost ratio   sum of shifted costs of the equilibrium over that of the optimum; finite, since
                 shifted costs are positive where lam > 0, and >= 1 where the optimum is proved
    risk ratio   Pr(any agent crashes) of the equilibrium over that of the optimum; a crash is an
                 overlap at the time steps, or during the steps where the game says so
    bound ratio  the same ratio of the union bounds

With the 95 % limits [l, h] of the two probabilities the risk ratio is within
[l_eq / h_opt, h_eq / l_opt].  One of the two is *significantly* riskier if their limits are
disjoint, that is, if the range does not contain 1.  Probabilities and limits below 1e-4 count as
1e-4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from benchmarks import sweeps
from benchmarks.studies.results import FREE, NEGLIGIBLE, StudyRow, crash_event, limits

EQUILIBRIA = ("nash", "potential")
OPTIMUM = "social"
PLAYERS = (*EQUILIBRIA, OPTIMUM)

SAME = 0.05
"""Costs that differ by at most this share count as about the same, as in the paper."""

FOUND = (
    "status", "social_cost", "risk_bound_any",
    "crash_probability", "crash_probability_low", "crash_probability_high",
)  # fmt: skip
"""Columns of a sweep's row that prices use."""


def digest(row: sweeps.Row, axes: Sequence[str]) -> StudyRow:
    """Return the columns that prices use; ``axes`` are the columns that identify games."""
    return {name: getattr(row, name) for name in (*axes, "player", *FOUND)}


@dataclass(frozen=True)
class Price:
    """The row of an equilibrium, and the row of the optimum of the same game."""

    selfish: StudyRow
    social: StudyRow

    @property
    def cost(self) -> float:
        """Cost ratio; costs below :data:`FREE` count as :data:`FREE`."""
        above, below = (max(row["social_cost"], FREE) for row in (self.selfish, self.social))
        return float(above / below)

    @property
    def same_cost(self) -> bool:
        """Whether the two cost about the same."""
        return abs(self.cost - 1) <= SAME

    @property
    def risk(self) -> float:
        """Risk ratio."""
        above, below = (
            max(row["crash_probability"], NEGLIGIBLE) for row in (self.selfish, self.social)
        )
        return float(above / below)

    @property
    def risk_text(self) -> str:
        """The risk ratio as text, in brackets unless the risks differ significantly."""
        return f"{self.risk:.3g}" if self.significant else f"({self.risk:.3g})"

    @property
    def least(self) -> float:
        """Lower limit of the risk ratio."""
        return limits(self.selfish)[0] / limits(self.social)[1]

    @property
    def most(self) -> float:
        """Upper limit of the risk ratio."""
        return limits(self.selfish)[1] / limits(self.social)[0]

    @property
    def riskier(self) -> bool:
        """Whether the equilibrium is significantly riskier."""
        return self.least > 1

    @property
    def safer(self) -> bool:
        """Whether the equilibrium is significantly safer."""
        return self.most < 1

    @property
    def significant(self) -> bool:
        """Whether the risks differ significantly."""
        return self.riskier or self.safer

    @property
    def bound(self) -> float | None:
        """Bound ratio; None on the paper's scale of margins, where the sum is not a bound."""
        above, below = (row.get("risk_bound_any") for row in (self.selfish, self.social))
        return above / below if above is not None and below else None


def prices(rows: Iterable[StudyRow], player: str, axes: Sequence[str]) -> list[Price]:
    """Return the prices of the equilibria of ``player``, in the order of the rows.

    Games without a result for one of the two are left out.
    """
    solved: dict[str, dict[tuple[object, ...], StudyRow]] = {player: {}, OPTIMUM: {}}
    for row in rows:
        if row["player"] in solved and "reason" not in row:
            solved[row["player"]][tuple(row[name] for name in axes)] = row
    return [
        Price(row, solved[OPTIMUM][game])
        for game, row in solved[player].items()
        if game in solved[OPTIMUM]
    ]


def costs(chosen: Sequence[Price]) -> str:
    """Return the range of cost ratios as text."""
    low, high = (pick(price.cost for price in chosen) for pick in (min, max))
    return f"{low:.3f}" if f"{low:.3f}" == f"{high:.3f}" else f"{low:.3f} to {high:.3f}"


def sides(chosen: Sequence[Price]) -> str:
    """Return the numbers of games in which the equilibrium is significantly riskier / safer."""
    return f"{sum(p.riskier for p in chosen)} / {sum(p.safer for p in chosen)}"


def riskiest(chosen: Sequence[Price]) -> Price:
    """Return the price whose risk ratio has the largest lower limit."""
    return max(chosen, key=lambda price: price.least)


SUMMARY = tuple(
    f"{what}\n{name}" for name in EQUILIBRIA for what in ("cost ratio", "riskier/safer", "most")
)
"""Heads of the columns of :func:`summary`."""


def summary_note(rows: Iterable[StudyRow]) -> str:
    """Return the note below a table of summaries."""
    return (
        f"Cost ratio: range. Riskier/safer: games in which any {crash_event(rows)} is "
        "significantly more, or less, probable at the equilibrium. Most: the risk ratio with the "
        "largest lower limit, if that is above one."
    )


def summary(chosen: Mapping[str, Sequence[Price]]) -> tuple[str, ...]:
    """Return a summary of costs and risks of some games, for each kind of equilibrium."""
    entries: list[str] = []
    for name in EQUILIBRIA:
        some = chosen.get(name)
        if not some:
            entries += ["-", "-", "-"]
            continue
        worst = riskiest(some)
        entries += [costs(some), sides(some), f"{worst.risk:.3g}" if worst.riskier else "-"]
    return tuple(entries)


def missing(rows: Sequence[StudyRow]) -> Iterator[str]:
    """Yield a sentence about missing plans, if there are any."""
    reasons = [row["reason"] for row in rows if "reason" in row]
    if reasons:
        yield f"{len(reasons)} plans are missing, the first because: {reasons[0]}."


def verdict(chosen: Sequence[Price], whose: str) -> str:
    """Return a sentence on costs and risks of ``whose`` plans, compared with the optimum."""
    same = sum(price.same_cost for price in chosen)
    riskier, safer = sum(p.riskier for p in chosen), sum(p.safer for p in chosen)
    both = sum(price.same_cost and price.riskier for price in chosen)
    return (
        f"{whose}: cost ratio {costs(chosen)}, within {SAME:.0%} of one in {same} of "
        f"{len(chosen)} games; significantly riskier than the optimum in {riskier}, safer in "
        f"{safer}, no significant difference in {len(chosen) - riskier - safer}; about the same "
        f"cost and riskier, as the paper claims, in {both}."
    )
