"""``ppg risk``: crash probabilities of a plan, or of a game's players."""

from __future__ import annotations

from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import (
    JsonOption,
    WorkersOption,
    named_game,
    with_game_options,
    with_group,
    with_planner_options,
)
from benchmarks.terminal import no_solution, print_json, print_table, working
from solvers.planner_options import DEFAULTS, PlannerOptions

if TYPE_CHECKING:
    from benchmarks.crash_risk.explanation import Explanation
    from benchmarks.crash_risk.query import RiskQuery, RiskReport

METHODS = {
    "bound": "benchmarks.crash_risk.analytic",
    "exact": "benchmarks.crash_risk.analytic",
    "mc": "benchmarks.crash_risk.simulated",
    "rare": "benchmarks.crash_risk.simulated",
}
"""The module of each method, under the method's name."""


@dataclass(frozen=True)
class Request:
    """How the probability is computed."""

    player: Annotated[
        str | None,
        typer.Option(help="The player of a game: a planner, or learned players (nash)."),
    ] = None
    method: Annotated[str, typer.Option(metavar="|".join(METHODS), help="How to find it.")] = "mc"
    arena: Annotated[
        str | None,
        typer.Option(
            metavar="schedule|env",
            help="For mc and rare: plans on schedule, or the environment (if a player needs it).",
        ),
    ] = None
    swept: Annotated[
        bool,
        typer.Option(
            "--swept",
            help="For mc and rare on schedule: between instants too, as games with collisions = "
            "swept do anyway.",
        ),
    ] = False
    against: Annotated[
        str | None,
        typer.Option(metavar="PLAN", help="For mc: another plan, simulated in the same noise."),
    ] = None
    episodes: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="For mc, 10^6 unless given; for rare, 10^5, or 40,000 of each level in env.",
        ),
    ] = None
    explain: Annotated[
        bool,
        typer.Option("--explain", help="For plans: print the likeliest crash and how it happens."),
    ] = False
    out: Annotated[
        str | None,
        typer.Option(metavar="PICTURE", help="Draw the likeliest crash: .png, .svg or .pdf."),
    ] = None
    workers: WorkersOption = 1


@with_game_options
@with_planner_options("solver", "time_limit", "seed")
@with_group("request", Request)
def risk(
    subject: Annotated[
        str,
        typer.Argument(
            metavar="PLAN|GAME", help="A .json plan that ppg solve --out wrote, or a game."
        ),
    ],
    *,
    request: Request,
    planner: PlannerOptions,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Compute crash probabilities of a plan or of a game's players: bounds, exact, simulated."""
    from importlib import import_module

    from benchmarks.crash_risk.query import EVENTS
    from ppg_env.game.evaluation import evaluate

    _check(request)
    with working(f"{request.method} of {subject}") as status:
        query = _query(subject, request, planner, overrides)
        violations: tuple[str, ...] = ()
        if query.profile is not None:
            violations = evaluate(query.game, query.profile).violations()
        query = _with_request(query, request, status)
        explanation = _explanation(query, request)
        started = monotonic()
        report = getattr(import_module(METHODS[request.method]), request.method)(query)
        seconds = monotonic() - started
    if violations:
        typer.echo(f"ppg: {subject} is no valid plan: {'; '.join(violations)}.", err=True)
    if as_json:
        print_json(
            {
                "agents": [vars(chance) for chance in report.agents],
                "any": vars(report.any),
                "method": request.method,
                "event": EVENTS[query.swept],
                "player": None if query.entrant is None else query.entrant.name,
                "samples": report.samples,
                "seconds": seconds,
                "complaints": violations,
                "details": report.details,
                **({} if explanation is None else {"likeliest_crash": explanation.report()}),
            }
        )
        return
    _print(f"{subject}: crash probability ({EVENTS[query.swept]}), {request.method}", query, report)
    if explanation is not None:
        explanation.print()


def _explanation(query: RiskQuery, request: Request) -> Explanation | None:
    """Return the likeliest crash, and draw it, if that was asked for."""
    if not request.explain:
        return None
    from benchmarks.crash_risk.explanation import explain

    explanation = explain(query)
    if request.out is not None:
        from benchmarks.crash_risk.picture import crash_picture

        crash_picture(explanation, request.out)
        typer.echo(f"picture: {request.out}", err=True)
    return explanation


def _check(request: Request) -> None:
    from benchmarks.comparison.players import check_arena
    from ppg_env.errors import require

    method = request.method
    require(method in METHODS, "--method", f"is {method!r}", "write " + " or ".join(METHODS))
    check_arena(request.arena)
    for name in ("arena", "swept", "against"):
        unused = getattr(request, name) and method not in ("mc", "rare")
        require(not unused, f"--{name}", "is for simulation", "add --method mc")
    if request.out is not None:
        from benchmarks.figures import picture_target

        require(request.explain, "--out", "draws the likeliest crash", "add --explain")
        picture_target("", request.out, as_json=False)


def _query(
    subject: str, request: Request, planner: PlannerOptions, overrides: dict[str, Any]
) -> RiskQuery:
    """Read a plan file with its game; or let the player of a game plan first."""
    from benchmarks.comparison.players import REPLANNING, chosen_player, entrant, refuse_unused
    from benchmarks.crash_risk.query import RiskQuery
    from ppg_env.formats.plan_file import read_plan

    if subject.endswith(".json"):
        _refuse_options_of_games(request, planner, overrides)
        game, profile, _ = read_plan(subject)
        return RiskQuery(game, profile, None, planner, request.arena or "schedule")
    name, arena = chosen_player("nash" if request.player is None else request.player, request.arena)
    refuse_unused(planner, [name])
    instance = named_game(subject, overrides)
    player = entrant(name, instance, planner)
    if player.solution is None:
        return RiskQuery(instance, None, player, planner, arena)
    if player.solution.profile is None:
        no_solution(player.solution.advice)
    replans = name in REPLANNING  # so its first plan is not what it plays
    return RiskQuery(instance, None if replans else player.solution.profile, player, planner, arena)


def _refuse_options_of_games(
    request: Request, planner: PlannerOptions, overrides: dict[str, Any]
) -> None:
    """Refuse options that a plan file leaves without effect."""
    from ppg_env.errors import require

    given = ["player"] * (request.player is not None) + list(overrides)
    given += [name for name in ("solver", "time_limit") if getattr(planner, name) != DEFAULTS[name]]
    option = f"--{given[0].replace('_', '-')}" if given else ""
    require(not given, option, "is for games", "leave it out with a plan")


def _with_request(query: RiskQuery, request: Request, status: Any) -> RiskQuery:
    """Add how to simulate, and show the episodes that are done."""
    from dataclasses import replace

    from ppg_env.formats.plan_file import read_plan
    from ppg_env.risk.crash_events import is_swept

    done = 0

    def on_progress(count: int) -> None:
        nonlocal done
        done += count
        status.update(f"simulated {done:,} episodes")

    return replace(
        query,
        against=None if request.against is None else read_plan(request.against)[:2],
        swept=request.swept or is_swept(query.game),
        episodes=request.episodes,
        workers=request.workers,
        progress=on_progress,
    )


def _print(title: str, query: RiskQuery, report: RiskReport) -> None:
    names = (*query.game.agent_names, "any")
    chances = (*report.agents, report.any)
    more = report.rows or [()] * len(chances)
    print_table(
        title,
        ("agent", "probability", *report.columns),
        [
            (name, str(chance), *cells)
            for name, chance, cells in zip(names, chances, more, strict=True)
        ],
        report.promise,
    )
