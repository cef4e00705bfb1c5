"""``ppg solve``: one solution of a game."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    GameArgument,
    JsonOption,
    named_game,
    with_game_options,
    with_planner_options,
)
from benchmarks.terminal import (
    NO_SOLUTION,
    no_solution,
    outward,
    print_json,
    print_note,
    print_table,
    times,
    working,
)
from solvers.planner_options import PlannerOptions, refuse_unused

if TYPE_CHECKING:
    from ppg_env.game.game import Game
    from solvers.solution import Solution

SOLUTIONS = ("nash", "potential", "social", "best-response")
RESPONSE_OPTIONS = ("solver", "time_limit", "charge")
"""Planner options that a best response accepts."""


@with_game_options
@with_planner_options("start", "order", "charge", "solver", "time_limit", "node_limit", "seed")
def solve(
    game: GameArgument,
    *,
    solution: Annotated[
        str, typer.Option(metavar="|".join(SOLUTIONS), help="What to solve for.")
    ] = "nash",
    agent: Annotated[int, typer.Option(help="The agent that plans a best response.")] = 0,
    against: Annotated[
        str | None, typer.Option(metavar="PLAN", help="The others' plans (straight lines).")
    ] = None,
    planner: PlannerOptions,
    out: Annotated[
        str | None, typer.Option(metavar="PLAN", help="Write the plan to this .json file.")
    ] = None,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Solve a game for a Nash equilibrium, the social optimum, or one agent's best response."""
    from benchmarks.comparison.report import solution_report
    from ppg_env.formats.plan_file import write_plan
    from ppg_env.support.atomic_write import check_target

    _check(solution, planner)
    instance = named_game(game, overrides)
    if out is not None:
        check_target(out, ".json")
    with working(f"{solution} of {game}") as status:

        def show(text: str) -> None:
            status.update(f"{solution} of {game}: {text}")

        if solution == "best-response":
            result = _best_response(instance, agent, against, planner)
        elif solution == "nash":
            result = _nash(instance, planner, show)
        else:
            result = _joint(instance, solution, planner, show)
    report = solution_report(result)
    if out is not None and result.profile is not None:
        write_plan(out, instance, result.profile, report)
        typer.echo(f"wrote {out}", err=True)
    _print(result, report, as_json)


def _check(solution: str, planner: PlannerOptions) -> None:
    """Refuse an unknown solution, and options that it does not accept."""
    from benchmarks.comparison.players import PLAYERS
    from ppg_env.errors import require

    require(
        solution in SOLUTIONS, "--solution", f"is {solution!r}", "write " + ", ".join(SOLUTIONS)
    )
    accepts = {name: PLAYERS[name].accepts for name in SOLUTIONS if name in PLAYERS}
    refuse_unused(planner, [solution], accepts | {"best-response": RESPONSE_OPTIONS})


def _nash(game: Game, planner: PlannerOptions, show: Callable[[str], None]) -> Solution:
    from solvers.equilibrium.best_response_dynamics import best_response_dynamics

    return best_response_dynamics(
        game,
        start=planner.start,
        order=planner.order,
        charge=planner.charge,
        seed=planner.seed,
        solver=planner.solver,
        time_limit=planner.time_limit,
        progress=lambda u: show(f"sweep {u.sweep}, agent {u.agent} pays {u.after:.4g}"),
    )


def _joint(
    game: Game, solution: str, planner: PlannerOptions, show: Callable[[str], None]
) -> Solution:
    from solvers.optimum.joint import potential_equilibrium, social_optimum

    minimise = social_optimum if solution == "social" else potential_equilibrium
    limits = {"value": float("inf"), "bound": float("-inf")}

    def on_progress(limit: str, value: float) -> None:
        limits[limit] = value
        show(f"between {limits['bound']:.6g} and {limits['value']:.6g}")

    return minimise(
        game,
        solver=planner.solver,
        time_limit=planner.time_limit,
        node_limit=planner.node_limit,
        seed=planner.seed,
        progress=on_progress,
    )


def _best_response(
    game: Game, agent: int, against: str | None, planner: PlannerOptions
) -> Solution:
    from benchmarks.comparison.players import entrant
    from ppg_env.errors import require
    from ppg_env.formats.plan_file import read_plan
    from solvers.equilibrium.best_response import best_response, check_agent

    check_agent(game, agent)
    if against is not None:
        other, profile, _ = read_plan(against)
        same = len(other.agents) == len(game.agents) and other.horizon == game.horizon
        require(same, "--against", "is a plan of another game", "give a plan of this one")
    else:
        straight = entrant("straight", game, planner).solution
        assert straight is not None
        if straight.profile is None:
            return straight
        profile = straight.profile
    return best_response(
        game,
        agent,
        profile,
        charge=planner.charge,
        solver=planner.solver,
        time_limit=planner.time_limit,
    )


def _print(result: Solution, report: dict[str, Any], as_json: bool) -> None:
    """Print the report or the table; exit with code 3 if there is no plan."""
    if as_json:
        print_json(report)
        if result.profile is None:
            raise typer.Exit(NO_SOLUTION)
    elif result.profile is None:
        no_solution(result.advice)
    else:
        _print_solution(result)


def _print_solution(result: Solution) -> None:
    from benchmarks.comparison.overlaps import between_steps_note
    from benchmarks.comparison.report import game_name
    from ppg_env.game.between_steps import overlap_times

    evaluation = result.evaluation
    assert evaluation is not None
    bounds = evaluation.risk_bound if result.game.scale == "exact" else None
    rows = [
        (
            name,
            times(evaluation.arrival[i : i + 1]),
            f"{evaluation.shifted_cost[i]:.4f}",
            f"{evaluation.deficit[i]:.4f}",
            "" if bounds is None else outward(float(bounds[i]), ".2e", up=True),
            "" if result.regret is None else outward(float(result.regret[i]), ".1e", up=True),
        )
        for i, name in enumerate(result.game.agent_names)
    ]
    proof = ""
    if result.minimised:
        proof = f"{result.minimised} = {result.value:.6g}, bound {result.bound:.6g}; "
    print_table(
        f"{result.name} of {game_name(result.game)}: {result.status} ({result.advice})",
        ("agent", "arrival", "shifted cost", "deficit", "risk bound", "regret at most"),
        rows,
        f"{proof}social cost {evaluation.social_cost:.6g}; risk bound: of an overlap "
        f"{overlap_times(result.game)}; {result.seconds:.2f} s",
    )
    print_note(between_steps_note(result.game, {"": result.profile}))
