"""Options of planners, declared once: the command line, comparisons and sweeps share them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from ppg_env.errors import InputError

SEARCH = ("solver", "time_limit", "node_limit", "seed")
"""Options of joint searches."""


@dataclass(frozen=True, kw_only=True)
class PlannerOptions:
    """Options of a planner; each player takes some of them, see ``PLAYERS``.

    Attributes
    ----------
    solver : ``ENGINE``, or the name of a MILP solver in cvxpy.
    time_limit : seconds for each solution; None is no limit.
    node_limit : linear programs of a joint search, independent of the machine; None is no limit.
    seed : random seed.
    start, order : first profile and order of moves of best-response dynamics; None is the
        planner's default.
    charge : liability rule of best-response dynamics, see :mod:`solvers.liability`.
    """

    solver: str = "ENGINE"
    time_limit: float | None = None
    node_limit: int | None = None
    seed: int = 0
    start: str | None = None
    order: str | tuple[int, ...] = "cyclic"
    charge: str = "selfish"

    def only(self, accepted: Collection[str]) -> PlannerOptions:
        """Return the ``accepted`` options; the others get their default values."""
        return PlannerOptions(**{name: getattr(self, name) for name in accepted})

    def search(self) -> dict[str, Any]:
        """Return what planners that minimise a joint function take as keyword arguments."""
        return {name: getattr(self, name) for name in SEARCH}


DEFAULTS = {option.name: option.default for option in fields(PlannerOptions)}
"""Name and default value of every option."""


def refuse_unused(
    options: PlannerOptions, chosen: Sequence[str], accepts: Mapping[str, Collection[str]]
) -> None:
    """Refuse an option that was changed although no ``chosen`` player accepts it.

    ``accepts`` has the accepted options of every player that could be chosen.  The seed is never
    refused: simulations use it too.

    Raises
    ------
    InputError
        With the names of the players that accept the option.
    """
    for name, default in DEFAULTS.items():
        takers = [player for player, accepted in accepts.items() if name in accepted]
        changed = name != "seed" and getattr(options, name) != default
        if changed and not set(takers) & set(chosen):
            raise InputError(
                f"--{name.replace('_', '-')}",
                f"has no effect for {', '.join(chosen)}",
                "leave it out, or choose " + " or ".join(takers),
            )
