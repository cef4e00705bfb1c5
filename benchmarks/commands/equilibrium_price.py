"""What ``ppg equilibria --price`` reports: costs of the equilibria found over the optimum's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from benchmarks.terminal import print_note, working
from ppg_env.errors import require
from ppg_env.game.evaluation import Evaluation
from ppg_env.game.game import Game
from solvers.planner_options import PlannerOptions


def price_report(
    game: Game, evaluations: Sequence[Evaluation], planner: PlannerOptions
) -> dict[str, Any]:
    """Return the social optimum, and the prices of stability and anarchy among ``evaluations``.

    Prices are ratios of social costs, each with its lower and its upper limit: the optimum is
    known up to its gap.  The price of stability is that of the cheapest equilibrium found, an
    upper bound on that of all; the price of anarchy that of the costliest, a lower bound.
    """
    from solvers.optimum.joint import social_optimum

    cheapest = min(evaluations, key=lambda evaluation: evaluation.social_cost)
    with working("social optimum") as status:
        optimum = social_optimum(
            game,
            start=cheapest.profile,
            solver=planner.solver,
            time_limit=planner.time_limit,
            seed=planner.seed,
            progress=lambda limit, value: status.update(f"social optimum: {limit} {value:.6g}"),
        )
    require(
        optimum.profile is not None and optimum.value is not None,
        "--price",
        f"has no social optimum to compare with ({optimum.advice})",
        "allow more time, or leave --price out",
    )
    assert optimum.evaluation is not None
    high = optimum.evaluation.social_cost
    low = high - (optimum.value - optimum.bound if optimum.bound is not None else high)
    costs = [evaluation.social_cost for evaluation in evaluations]
    prices = {"price_of_stability": min(costs), "price_of_anarchy": max(costs)}
    return {"optimum": [low, high]} | {
        name: [cost / high, cost / low if low > 0 else float("inf")]
        for name, cost in prices.items()
    }


def print_price(report: dict[str, Any], runs: int) -> None:
    """Print the prices, with their limits if the optimum is not proved."""
    low, high = report["optimum"]
    print_note(
        f"social optimum {_interval(low, high)}; among the equilibria of {runs} runs: price of "
        f"stability {_interval(*report['price_of_stability'])}, price of anarchy "
        f"{_interval(*report['price_of_anarchy'])} (social cost over the optimum's)"
    )


def _interval(low: float, high: float) -> str:
    one, other = f"{low:.4f}", f"{high:.4f}"
    return one if one == other else f"{one} to {other}"
