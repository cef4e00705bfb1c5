"""``ppg library run`` and ``report``: solvers over the games, and their ranking."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.commands.library_games import NamesArgument, Selection, selected
from benchmarks.options import JsonOption, shard_numbers, with_group
from benchmarks.terminal import NO_SOLUTION, bar, print_json, print_table

if TYPE_CHECKING:
    from benchmarks.library.instance import Instance
    from benchmarks.library.ranking import Standing
    from benchmarks.library.runs import RunPlan


@dataclass(frozen=True)
class RunOptions:
    """How a solver runs, and what is kept."""

    time_limit: Annotated[
        float, typer.Option(min=0.0, metavar="S", help="Seconds for each game.")
    ] = 10.0
    node_limit: Annotated[
        int | None,
        typer.Option(min=1, help="Linear programs for each game, for social and potential."),
    ] = None
    budget: Annotated[
        float | None, typer.Option(metavar="S", help="Start no game after so many seconds.")
    ] = None
    label: Annotated[
        str | None, typer.Option(metavar="NAME", help="Name in rankings (the solver).")
    ] = None
    runs: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Lines of the run (out/library/NAME.jsonl)."),
    ] = None
    shard: Annotated[
        str, typer.Option(metavar="I/N", help="Run the I-th of N parts, for several machines.")
    ] = "1/1"
    improve: Annotated[
        bool, typer.Option("--submit", help="Put better plans and bounds into the records.")
    ] = False


@with_group("selection", Selection)
@with_group("options", RunOptions)
def run(
    solver: Annotated[
        str,
        typer.Argument(
            metavar="SOLVER",
            help="social, potential, nash, straight, or 'COMMAND {game} {plan}' in quotes.",
        ),
    ],
    names: NamesArgument = None,
    *,
    selection: Selection,
    options: RunOptions,
    as_json: JsonOption = False,
) -> None:
    """Run a solver over games, check its plans, and rank it; a stopped run continues."""
    from benchmarks.library.runs import read_lines
    from benchmarks.library.runs import run as run_games
    from ppg_env.errors import require

    index, count = shard_numbers(options.shard)
    require(1 <= index <= count, "--shard", f"is {options.shard}", "write i/n with 1 <= i <= n")
    games = selected(names, selection)[index - 1 :: count]
    plan = _run_plan(solver, options)
    with bar(f"{plan.label} over {len(games)} games", len(games)) as advance:
        for _ in run_games(plan, games, options.budget):
            advance(1)
    own = {game.name for game in games}
    lines = read_lines(plan.path) if plan.path.exists() else []
    lines = [line for line in lines if line["game"] in own]
    ran = {line["game"] for line in lines}
    _print_ranking([game for game in games if game.name in ran], lines, as_json)
    if not any(line["status"] == "accepted" for line in lines):
        raise typer.Exit(NO_SOLUTION)


def _run_plan(solver: str, options: RunOptions) -> RunPlan:
    from benchmarks.library.runs import RunPlan
    from benchmarks.library.solver_run import OURS, check_solver_name
    from ppg_env.errors import require
    from ppg_env.support.atomic_write import check_target

    check_solver_name(solver)
    label = options.label or solver
    require(
        solver in OURS or label not in OURS, "--label", f"is {label}, one of ours", "write another"
    )
    stem = re.sub(r"[^A-Za-z0-9]+", "-", label).strip("-")[:60] or "solver"
    path = Path("out/library") / f"{stem}.jsonl"
    if options.runs is not None:
        path = Path(options.runs)
        check_target(path, ".jsonl")
    path.parent.mkdir(parents=True, exist_ok=True)
    plans = None if solver in OURS else path.with_suffix("")
    limits = (options.time_limit, options.node_limit)
    return RunPlan(solver, label, *limits, path, plans, options.improve)


def _print_ranking(
    games: Sequence[Instance], lines: Sequence[dict[str, Any]], as_json: bool
) -> None:
    from benchmarks.library.ranking import standings
    from benchmarks.library.summary import project_lines

    ranked = standings(games, [*project_lines(), *lines])
    if as_json:
        print_json({"games": len(games), "ranking": _ranking(ranked), "lines": lines})
        return
    rows = [
        (s.label, f"{s.score:.1f}", *map(str, (s.accepted, s.best, s.refused)), f"{s.seconds:.1f}")
        for s in ranked
    ]
    columns = ("solver", "score", "accepted", "as good as known", "refused", "CPU s")
    print_table(f"Ranking over {len(games)} games", columns, rows)
    for line in [line for line in lines if line["status"] != "accepted"][:5]:
        typer.echo(f"{line['game']}: {line['status']}: {line['said']}", err=True)


def _ranking(ranked: Sequence[Standing]) -> list[dict[str, Any]]:
    return [{"solver": one.label, "score": one.score, "accepted": one.accepted} for one in ranked]


@with_group("selection", Selection)
def report(
    names: NamesArgument = None,
    *,
    selection: Selection,
    runs: Annotated[
        list[str] | None, typer.Option(metavar="FILE", help="More runs to rank; repeat it.")
    ] = None,
    out: Annotated[
        str | None, typer.Option(metavar="HTML", help="The page (out/library.html).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a page with performance profiles, gaps and records."""
    from benchmarks.library.page import page
    from benchmarks.library.ranking import ran_by_all, standings
    from benchmarks.library.runs import read_lines
    from benchmarks.library.summary import project_lines
    from benchmarks.output_paths import own_folder, target
    from ppg_env.support.atomic_write import write_atomically

    path = target("library", out, ".html")
    own_folder(path)
    games = selected(names, selection)
    lines = project_lines() + [line for file in runs or () for line in read_lines(Path(file))]
    ranked = standings(ran_by_all(games, lines), lines)
    write_atomically(path, page(games, ranked))
    typer.echo(f"report: {path}", err=True)
    if as_json:
        print_json({"report": path, "games": len(games), "ranking": _ranking(ranked)})
