"""``ppg equilibria``: the different equilibria of a game."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    SeedOption,
    SolverOption,
    TimeLimitOption,
    with_game_options,
)
from benchmarks.terminal import bar, no_solution, print_json, print_table


@with_game_options
def equilibria(
    game: GameArgument,
    overrides: dict[str, Any],
    runs: Annotated[int, typer.Option(min=1, help="Runs of the dynamics.")] = 20,
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Collect certified equilibria from many starts and orders; name the best and the worst."""
    from benchmarks.comparison.report import evaluation_report, game_name
    from ppg_env import tolerances as tol
    from ppg_env.scenarios.make import make_game
    from solvers.equilibrium.enumeration import collect_equilibria

    made = make_game(game, **overrides)
    with bar(f"equilibria of {game}", runs) as advance:
        found = collect_equilibria(
            made, runs=runs, seed=seed, solver=solver, time_limit=time_limit, progress=advance
        )
    if not found:
        no_solution(f"none of {runs} runs came to an equilibrium; allow more runs or time")
    judged = [one.solution.evaluation for one in found if one.solution.evaluation is not None]
    risks = [one.risk_bound_any for one in judged]
    safest, riskiest = risks.index(min(risks)), risks.index(max(risks))
    if as_json:
        print_json(
            {
                "scenario": game_name(made),
                "runs": runs,
                "equilibria": [
                    {
                        "name": kind.name,
                        "found": kind.found,
                        "regret": kind.solution.regret,
                        **evaluation_report(one),
                    }
                    for kind, one in zip(found, judged, strict=True)
                ],
                "cheapest": 0,
                "dearest": len(found) - 1,
                "safest": safest,
                "riskiest": riskiest,
            }
        )
        return
    words: dict[int, list[str]] = {}
    if judged[-1].social_cost - judged[0].social_cost > tol.AGREEMENT:
        words[0], words[len(found) - 1] = ["cheapest"], ["dearest"]
    if risks[riskiest] > risks[safest] * (1 + tol.AGREEMENT):
        words.setdefault(safest, []).append("safest")
        words.setdefault(riskiest, []).append("riskiest")
    rows = [
        (
            kind.name,
            ", ".join(words.get(k, [])),
            f"{one.social_cost:.4f}",
            f"{one.risk_bound_any:.2e}",
            " ".join(map(str, one.arrival)),
            f"{kind.solution.regret.max():.1e}" if kind.solution.regret is not None else "",
            f"{kind.found}",
        )
        for k, (kind, one) in enumerate(zip(found, judged, strict=True))
    ]
    print_table(
        f"{game_name(made)}: kinds of equilibrium that {runs} runs came to",
        ("who passes whom", "", "social cost", "crash risk at most", "arrivals", "regret", "runs"),
        rows,
        texts=2,
    )
