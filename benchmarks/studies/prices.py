r"""An equilibrium beside the social optimum of the same game: what selfishness costs, and risks.

    cost ratio   sum of shifted costs of the equilibrium over that of the optimum; finite, since
                 shifted costs are positive where lam > 0, and >= 1 where the optimum is proved
    risk ratio   Pr(anybody crashes) of the equilibrium over that of the optimum
    bound ratio  the same of the union bounds

With the 95 % limits [l, h] of the two probabilities the risk ratio is within
[l_eq / h_opt, h_eq / l_opt].  One of the two is called riskier *beyond doubt* if their limits are
disjoint, which is when that range does not contain 1.  Probabilities and limits below 1e-4 count as
1e-4 in all this.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from benchmarks import sweeps
from benchmarks.studies.results import FREE, NEGLIGIBLE, StudyRow, limits

EQUILIBRIA = ("nash", "potential")
OPTIMUM = "social"
PLAYERS = (*EQUILIBRIA, OPTIMUM)

SAME = 0.05
"""Costs within this share of each other count as about the same, as the paper has it."""

FOUND = (
    "status", "social_cost", "risk_bound_any",
    "crash_probability", "crash_probability_low", "crash_probability_high",
)  # fmt: skip
"""Columns of a sweep's row that prices are computed from."""


def digest(row: sweeps.Row, axes: Sequence[str]) -> StudyRow:
    """What prices are computed from; ``axes`` are the columns that tell games apart."""
    return {name: getattr(row, name) for name in (*axes, "player", *FOUND)}


@dataclass(frozen=True)
class Price:
    """The row of an equilibrium, and that of the optimum of the same game."""

    selfish: StudyRow
    social: StudyRow

    @property
    def cost(self) -> float:
        """Cost ratio; costs below :data:`FREE` count as that."""
        above, below = (max(row["social_cost"], FREE) for row in (self.selfish, self.social))
        return float(above / below)

    @property
    def same_cost(self) -> bool:
        """Whether the two are about as cheap."""
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
        """The risk ratio as text, in brackets where the two risks are not told apart."""
        return f"{self.risk:.3g}" if self.riskier or self.safer else f"({self.risk:.3g})"

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
        """Whether the equilibrium is riskier beyond doubt."""
        return self.least > 1

    @property
    def safer(self) -> bool:
        """Whether the equilibrium is safer beyond doubt."""
        return self.most < 1

    @property
    def bound(self) -> float | None:
        """Bound ratio; None where margins are on the paper's scale, whose sum is no bound."""
        above, below = (row.get("risk_bound_any") for row in (self.selfish, self.social))
        return above / below if above is not None and below else None


def prices(rows: Iterable[StudyRow], player: str, axes: Sequence[str]) -> list[Price]:
    """Prices of the equilibria of ``player``, in the order of the rows.

    Games in which one of the two has no result are left out.
    """
    found: dict[str, dict[tuple[object, ...], StudyRow]] = {player: {}, OPTIMUM: {}}
    for row in rows:
        if row["player"] in found and "reason" not in row:
            found[row["player"]][tuple(row[name] for name in axes)] = row
    return [
        Price(row, found[OPTIMUM][game])
        for game, row in found[player].items()
        if game in found[OPTIMUM]
    ]


def costs(chosen: Sequence[Price]) -> str:
    """The range of cost ratios."""
    low, high = (pick(one.cost for one in chosen) for pick in (min, max))
    return f"{low:.3f}" if f"{low:.3f}" == f"{high:.3f}" else f"{low:.3f} to {high:.3f}"


def sides(chosen: Sequence[Price]) -> str:
    """In how many games the equilibrium is riskier, and in how many safer, beyond doubt."""
    return f"{sum(one.riskier for one in chosen)} / {sum(one.safer for one in chosen)}"


def riskiest(chosen: Sequence[Price]) -> Price:
    """The price whose risk ratio has the highest lower limit."""
    return max(chosen, key=lambda one: one.least)


SUMMARY = tuple(
    f"{what}\n{name}" for name in EQUILIBRIA for what in ("cost ratio", "riskier/safer", "most")
)
"""Heads of what :func:`summary` says."""

NOTE = (
    "Cost ratio: range. Riskier/safer: games in which the equilibrium is beyond doubt the riskier, "
    "or the safer one. Most: the risk ratio whose lower limit is highest, if it is above one."
)


def summary(chosen: Mapping[str, Sequence[Price]]) -> tuple[str, ...]:
    """Costs and risks of some games in short, for each kind of equilibrium."""
    told: list[str] = []
    for name in EQUILIBRIA:
        some = chosen.get(name)
        if not some:
            told += ["-", "-", "-"]
            continue
        worst = riskiest(some)
        told += [costs(some), sides(some), f"{worst.risk:.3g}" if worst.riskier else "-"]
    return tuple(told)


def missing(rows: Sequence[StudyRow]) -> Iterator[str]:
    """A sentence on plans that were not found, if there are any."""
    reasons = [row["reason"] for row in rows if "reason" in row]
    if reasons:
        yield f"{len(reasons)} plans are missing, the first because: {reasons[0]}."


def verdict(chosen: Sequence[Price], whose: str) -> str:
    """A sentence on costs and risks of ``whose`` plans, against the optimum."""
    same = sum(one.same_cost for one in chosen)
    riskier, safer = sum(one.riskier for one in chosen), sum(one.safer for one in chosen)
    both = sum(one.same_cost and one.riskier for one in chosen)
    return (
        f"{whose}: cost ratio {costs(chosen)}, within {SAME:.0%} of one in {same} of "
        f"{len(chosen)} games; riskier than the optimum beyond doubt in {riskier}, safer in "
        f"{safer}, not told apart in {len(chosen) - riskier - safer}; about as cheap and riskier, "
        f"as the paper has it, in {both}."
    )
