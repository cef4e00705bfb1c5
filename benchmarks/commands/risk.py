"""``ppg risk``: how likely do the agents crash?"""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    JsonOption,
    SeedOption,
    SolverOption,
    TimeLimitOption,
    WorkersOption,
    with_game_options,
)
from benchmarks.terminal import no_solution, print_json, print_table, working

if TYPE_CHECKING:
    from benchmarks.comparison.players import PlannerOptions
    from benchmarks.crash_risk.analytic import RiskQuery

METHODS = {
    "bound": "benchmarks.crash_risk.analytic",
    "exact": "benchmarks.crash_risk.analytic",
    "mc": "benchmarks.crash_risk.simulated",
    "rare": "benchmarks.crash_risk.simulated",
}
"""Where each method is at home, under its name."""


@with_game_options
def risk(
    subject: Annotated[
        str,
        typer.Argument(
            metavar="PLAN|GAME", help="A .json plan that ppg solve --out wrote, or a game."
        ),
    ],
    overrides: dict[str, Any],
    player: Annotated[
        str | None,
        typer.Option(help="Who plays a game, by name: a planner, or learned players (nash)."),
    ] = None,
    method: Annotated[str, typer.Option(metavar="|".join(METHODS), help="How to find it.")] = "mc",
    arena: Annotated[
        str | None,
        typer.Option(
            metavar="schedule|env",
            help="For mc and rare: plans on schedule, or the environment (if a player needs it).",
        ),
    ] = None,
    swept: Annotated[
        bool, typer.Option("--swept", help="For mc and rare on schedule: between instants too.")
    ] = False,
    against: Annotated[
        str | None,
        typer.Option(metavar="PLAN", help="For mc: another plan, flown in the same noise."),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="For mc, 10^6 unless given; for rare, 10^5, or 40,000 of each level in env.",
        ),
    ] = None,
    workers: WorkersOption = 1,
    solver: SolverOption = "ENGINE",
    time_limit: TimeLimitOption = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Crash probability of a plan or of a game's players: bounded, exact at instants, simulated."""
    from dataclasses import replace
    from importlib import import_module

    from benchmarks.comparison.players import ARENAS, PlannerOptions
    from ppg_env.errors import require
    from ppg_env.formats.plan_file import read_plan
    from ppg_env.game.evaluation import evaluate
    from solvers.dispatch import check_solver

    require(method in METHODS, "--method", f"is {method!r}", "write " + " or ".join(METHODS))
    known = arena is None or arena in ARENAS
    require(known, "--arena", f"is {arena!r}", "write " + " or ".join(ARENAS))
    simulated = method in ("mc", "rare")
    for option, given in (("--arena", arena), ("--swept", swept), ("--against", against)):
        require(simulated or not given, option, "is for simulation", "add --method mc")
    limits = PlannerOptions(check_solver(solver), time_limit, seed)
    with working(f"{method} of {subject}") as status:
        asked = _query(subject, player, overrides, arena, limits)
        violations: tuple[str, ...] = ()
        if asked.profile is not None:
            violations = evaluate(asked.game, asked.profile).violations()
        done, begun = 0, monotonic()

        def tell(count: int) -> None:
            nonlocal done
            done += count
            status.update(f"simulated {done:,} episodes")

        asked = replace(
            asked,
            against=None if against is None else read_plan(against)[:2],
            swept=swept,
            episodes=episodes,
            workers=workers,
            progress=tell,
        )
        found = getattr(import_module(METHODS[method]), method)(asked)
        seconds = monotonic() - begun
    if violations:
        typer.echo(f"ppg: {subject} is no valid plan: {'; '.join(violations)}.", err=True)
    if as_json:
        print_json(
            {
                "agents": [vars(chance) for chance in found.agents],
                "any": vars(found.any),
                "method": method,
                "player": None if asked.entrant is None else asked.entrant.name,
                "samples": found.samples,
                "seconds": seconds,
                "complaints": violations,
                "details": found.details,
            }
        )
        return
    more = found.rows or [()] * (len(found.agents) + 1)
    names = (*asked.game.agent_names, "any")
    print_table(
        f"{subject}: crash probability, {method}",
        ("agent", "probability", *found.columns),
        [
            (name, str(chance), *cells)
            for name, chance, cells in zip(names, (*found.agents, found.any), more, strict=True)
        ],
        found.promise,
    )


def _query(
    subject: str,
    player: str | None,
    overrides: dict[str, Any],
    arena: str | None,
    limits: PlannerOptions,
) -> RiskQuery:
    """A plan file has its game and its plans; in a game, planners plan first."""
    from benchmarks.comparison.players import RECEDING, chosen_players, entrant
    from benchmarks.crash_risk.analytic import RiskQuery
    from ppg_env.errors import require
    from ppg_env.formats.plan_file import read_plan
    from ppg_env.scenarios.make import make_game

    if subject.endswith(".json"):
        given = ["--player"] * (player is not None)
        given += [f"--{name.replace('_', '-')}" for name in overrides]
        require(not given, given[0] if given else "", "is for games", "leave it out with a plan")
        game, profile, _ = read_plan(subject)
        return RiskQuery(game, profile, None, limits, arena or "schedule")
    names, arena = chosen_players("nash" if player is None else player, arena, "--player")
    require(len(names) == 1, "--player", "has several names", "name one")
    made = make_game(subject, **overrides)
    who = entrant(names[0], made, limits)
    if who.solution is None:
        return RiskQuery(made, None, who, limits, arena)
    if who.solution.profile is None:
        no_solution(who.solution.advice)
    anew = who.name == RECEDING  # its first plan is not what it plays
    return RiskQuery(made, None if anew else who.solution.profile, who, limits, arena)
