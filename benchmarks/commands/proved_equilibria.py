"""What ``ppg equilibria --prove`` reports: intervals for the best and the worst equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import typer

from benchmarks.terminal import outward, print_table
from ppg_env import tolerances as tol

if TYPE_CHECKING:
    from ppg_env.game.game import Game
    from solvers.equilibrium.enumeration import Equilibrium
    from solvers.extremes.bounds_result import Between, EquilibriumBounds

SECONDS = 300.0
"""Time limit of the proof, if none is given."""


def bound_equilibria(
    game: Game, kinds: Sequence[Equilibrium], time_limit: float | None
) -> EquilibriumBounds:
    """Bound the best and the worst equilibrium; every better interval is printed on stderr."""
    from solvers import equilibrium_bounds

    seconds = SECONDS if time_limit is None else time_limit
    return equilibrium_bounds(game, sampled=kinds, time_limit=seconds, progress=_show)


def _show(bounds: EquilibriumBounds) -> None:
    typer.echo(f"best in {_text(bounds.best)}, worst in {_text(bounds.worst)}", err=True)


def proof_report(bounds: EquilibriumBounds) -> dict[str, Any]:
    """Return the intervals as JSON, each as its lower and its upper limit."""
    names = (
        *("optimum", "best", "worst", "risk"),
        *("price_of_stability", "price_of_anarchy"),
    )
    return {name: list(getattr(bounds, name)) for name in names} | {
        name: getattr(bounds, name)
        for name in ("epsilon", "refined", "arrivals", "open", "inequalities", "seconds")
    }


def print_proof(bounds: EquilibriumBounds) -> None:
    """Print a table of the intervals."""
    rows = [
        ("social optimum", _text(bounds.optimum), ""),
        ("best equilibrium", _text(bounds.best), _text(bounds.price_of_stability)),
        ("worst equilibrium", _text(bounds.worst), _text(bounds.price_of_anarchy)),
    ]
    remaining = (
        f"{bounds.open} of {bounds.arrivals} vectors of arrivals are not settled"
        if bounds.refined
        else "coarse limits: proofs need two agents without obstacles and effort, that keep apart "
        "at instants and leave at their goals"
    )
    risk = " to ".join(outward(value, ".2e", up=k == 1) for k, value in enumerate(bounds.risk))
    print_table(
        "proved about all equilibria in plans",
        ("", "social cost", "over the optimum"),
        rows,
        f"equilibria: no agent gains more than {bounds.epsilon:g}; crash risk of each {risk}; "
        + remaining,
    )


def _text(interval: Between) -> str:
    """Return an interval rounded outwards, up to the tolerance of the bounds."""
    low = outward(interval.low + tol.AGREEMENT, ".4f", up=False)
    high = outward(interval.high - tol.AGREEMENT, ".4f", up=True)
    return f"{low} to {high}"
