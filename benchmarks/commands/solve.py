"""``ppg solve``: one solution of a game."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    ChargeOption,
    GameArgument,
    JsonOption,
    SeedOption,
    SolverOption,
    TimeLimitOption,
    with_game_options,
)
from benchmarks.terminal import NO_SOLUTION, no_solution, print_json, print_table, times, working

if TYPE_CHECKING:
    from ppg_env.game.game import Game
    from solvers.solution import Solution

SOLUTIONS = ("nash", "potential", "social", "best-response")


@with_game_options
def solve(
    game: GameArgument,
    overrides: dict[str, Any],
    solution: Annotated[
        str, typer.Option(metavar="|".join(SOLUTIONS), help="What to solve for.")
    ] = "nash",
    agent: Annotated[int, typer.Option(help="Who plans in a best response.")] = 0,
    against: Annotated[
        str | None, typer.Option(metavar="PLAN", help="The others' plans (straight lines).")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="straight|sequential",
            help="First profile of nash (straight up to 5 agents, else sequential).",
        ),
    ] = None,
    order: Annotated[
        str, typer.Option(metavar="cyclic|random|simultaneous", help="Who moves when.")
    ] = "cyclic",
    charge: ChargeOption = "selfish",
    out: Annotated[
        str | None, typer.Option(metavar="PLAN", help="Write the plan to this .json file.")
    ] = None,
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = None,
    node_limit: Annotated[
        int | None,
        typer.Option(min=1, help="Linear programs for social and potential, machine-independent."),
    ] = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Solve a game for a Nash equilibrium, the social optimum, or one agent's best response."""
    from benchmarks.comparison.report import solution_report
    from ppg_env.errors import require
    from ppg_env.formats.plan_file import write_plan
    from ppg_env.scenarios.make import make_game
    from ppg_env.support.atomic_write import check_target

    require(
        solution in SOLUTIONS, "--solution", f"is {solution!r}", "write " + ", ".join(SOLUTIONS)
    )
    joint = solution in ("social", "potential")
    remedy = "leave it out, or solve for social or potential"
    require(joint or node_limit is None, "--node-limit", f"is not heeded by {solution}", remedy)
    made = make_game(game, **overrides)
    if out is not None:
        check_target(out, ".json")
    with working(f"{solution} of {game}") as status:
        if solution == "best-response":
            found = _best_response(made, agent, against, charge, solver, time_limit)
        elif solution == "nash":
            from solvers.equilibrium.best_response_dynamics import best_response_dynamics

            found = best_response_dynamics(
                made,
                start=start,
                order=order,
                charge=charge,
                seed=seed,
                solver=solver,
                time_limit=time_limit,
                progress=lambda u: status.update(
                    f"nash of {game}: sweep {u.sweep}, agent {u.agent} pays {u.after:.4g}"
                ),
            )
        else:
            from solvers.optimum.joint import potential_equilibrium, social_optimum

            planner = social_optimum if solution == "social" else potential_equilibrium
            news = {"value": float("inf"), "bound": float("-inf")}

            def tell(what: str, value: float) -> None:
                news[what] = value
                status.update(
                    f"{solution} of {game}: between {news['bound']:.6g} and {news['value']:.6g}"
                )

            found = planner(
                made,
                solver=solver,
                time_limit=time_limit,
                node_limit=node_limit,
                seed=seed,
                progress=tell,
            )
    report = solution_report(found)
    if out is not None and found.profile is not None:
        write_plan(out, made, found.profile, report)
        typer.echo(f"wrote {out}", err=True)
    if as_json:
        print_json(report)
        if found.profile is None:
            raise typer.Exit(NO_SOLUTION)
    elif found.profile is None:
        no_solution(found.advice)
    else:
        _print(found)


def _best_response(
    game: Game,
    agent: int,
    against: str | None,
    charge: str,
    solver: str,
    time_limit: float | None,
) -> Solution:
    from benchmarks.comparison.players import PLANNERS, PlannerOptions
    from ppg_env.errors import require
    from ppg_env.formats.plan_file import read_plan
    from solvers.equilibrium.best_response import best_response, check_agent

    check_agent(game, agent)
    if against is not None:
        other, profile, _ = read_plan(against)
        same = len(other.agents) == len(game.agents) and other.horizon == game.horizon
        require(same, "--against", "is a plan of another game", "give a plan of this one")
    else:
        straight = PLANNERS["straight"](game, PlannerOptions())
        if straight.profile is None:
            return straight
        profile = straight.profile
    return best_response(game, agent, profile, charge=charge, solver=solver, time_limit=time_limit)


def _print(found: Solution) -> None:
    from benchmarks.comparison.report import game_name

    judged = found.evaluation
    assert judged is not None
    rows = []
    for i, name in enumerate(found.game.agent_names):
        regret = "" if found.regret is None else f"{found.regret[i]:.1e}"
        rows.append(
            (
                name,
                times(judged.arrival[i : i + 1]),
                f"{judged.shifted_cost[i]:.4f}",
                f"{judged.deficit[i]:.4f}",
                f"{judged.risk_sum[i]:.2e}",
                regret,
            )
        )
    proof = (
        f"{found.minimised} = {found.value:.6g}, bound {found.bound:.6g}; "
        if found.minimised
        else ""
    )
    print_table(
        f"{found.name} of {game_name(found.game)}: {found.status} ({found.advice})",
        ("agent", "arrival", "shifted cost", "deficit", "risk bound", "regret at most"),
        rows,
        f"{proof}social cost {judged.social_cost:.6g}; {found.seconds:.2f} s",
    )
