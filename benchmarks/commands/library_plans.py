"""``ppg library check`` and ``submit``: plans and the independent checker."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from benchmarks.commands.library_games import NamesArgument, Selection, selected, selected_one
from benchmarks.options import JsonOption, with_group
from benchmarks.terminal import NO_SOLUTION, print_json


@with_group("selection", Selection)
def check(
    names: NamesArgument = None,
    *,
    selection: Selection,
    plan: Annotated[
        str | None, typer.Option(metavar="PLAN", help="Check this plan of one game instead.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Let the independent checker recompute all recorded plans, or one plan file."""
    from benchmarks.library.judge import read_plan_text, recorded_plans, verdict
    from ppg_env.errors import require

    rows: list[dict[str, Any]] = []
    games = selected(names, selection)
    if plan is not None:
        require(len(games) == 1, "--plan", f"is given for {len(games)} games", "name one game")
    for instance in games:
        plans = {
            what: (entry["plan"], entry["social_cost"])
            for what, entry in recorded_plans(instance.record).items()
        }
        if plan is not None:
            plans = {plan: (read_plan_text(Path(plan)), None)}
        for what, (content, stated) in plans.items():
            answer = verdict(instance, content)
            cost, defects = answer.get("social_cost"), list(answer["defects"])
            if stated is not None and cost is not None and abs(cost - stated) > 1e-9 * abs(stated):
                defects.append(f"the record states a social cost of {stated!r}, not {cost!r}")
            rows.append(
                {"game": instance.name, "plan": what, "social_cost": cost, "defects": defects}
            )
    refused = [row for row in rows if row["defects"]]
    if as_json:
        print_json({"checked": len(rows), "refused": refused})
    else:
        typer.echo(f"{len(rows)} plans checked, {len(refused)} refused")
        for row in refused:
            typer.echo(f"{row['game']} {row['plan']}: {'; '.join(row['defects'][:5])}")
    if refused:
        raise typer.Exit(NO_SOLUTION)


@with_group("selection", Selection)
def submit(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A game.")],
    plan: Annotated[str, typer.Argument(metavar="PLAN", help="A file of arrival and controls.")],
    *,
    selection: Selection,
    by: Annotated[str, typer.Option(metavar="NAME", help="Whom or what the record names.")] = "",
    certify: Annotated[
        bool, typer.Option("--certify", help="Certify regrets, too, and offer an equilibrium.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Check a plan, and replace the record if the plan is better; the history is kept."""
    from benchmarks.library.judge import read_plan_text
    from benchmarks.library.judge import submit as offer
    from ppg_env.errors import require

    require(bool(by.strip()), "--by", "is missing", "name who or what found the plan")
    instance = selected_one(name, selection)
    answer = offer(instance, read_plan_text(Path(plan)), by.strip()[:100], certify=certify)
    answer.pop("means", None)
    if as_json:
        print_json({"game": instance.name, **answer})
    elif not answer["accepted"]:
        typer.echo(f"{instance.name}: refused: " + "; ".join(answer["defects"][:5]))
    else:
        what = ", ".join(answer["improves"]) or "nothing"
        typer.echo(f"{instance.name}: social cost {answer['social_cost']:.9g}; improves {what}")
    if not answer["accepted"]:
        raise typer.Exit(NO_SOLUTION)
