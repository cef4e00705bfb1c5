"""``ppg library list`` and ``show``, and how the commands of the library select games."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.commands.library_tables import PLAYER_COLUMNS, player_row
from benchmarks.options import JsonOption, with_group
from benchmarks.terminal import outward, print_json, print_table

if TYPE_CHECKING:
    from benchmarks.library.instance import Instance

SORTS = ("name", "class", "agents", "gap")

NamesArgument = Annotated[
    list[str] | None, typer.Argument(metavar="NAMES", help="Games; * stands for any text.")
]


@dataclass(frozen=True)
class Selection:
    """Which games."""

    kind: Annotated[
        str | None, typer.Option("--class", metavar="easy|hard|open", help="Only this class.")
    ] = None
    games: Annotated[
        str | None, typer.Option(metavar="FOLDER", help="Folder of the games (the checkout's).")
    ] = None


def selected(names: Sequence[str] | None, selection: Selection) -> list[Instance]:
    """Return the games that a command names."""
    from benchmarks.library.instance import FOLDER, chosen

    folder = FOLDER if selection.games is None else Path(selection.games)
    return chosen(names or (), kind=selection.kind, folder=folder)


def selected_one(name: str, selection: Selection) -> Instance:
    """Return the only game that a command names."""
    from ppg_env.errors import require

    games = selected([name], selection)
    require(len(games) == 1, f"{name!r:.80}", f"names {len(games)} games", "name one")
    return games[0]


@with_group("selection", Selection)
def list_games(
    names: NamesArgument = None,
    *,
    selection: Selection,
    sort: Annotated[str, typer.Option(metavar="|".join(SORTS), help="Order.")] = "name",
    as_json: JsonOption = False,
) -> None:
    """List games with the best social cost, its gap, equilibria, and the best known player."""
    from ppg_env.errors import require

    require(sort in SORTS, "--sort", f"is {sort!r}", "write " + ", ".join(SORTS))
    rows = sorted(
        (_row(one) for one in selected(names, selection)), key=lambda row: _key(row, sort)
    )
    if as_json:
        print_json({"games": rows})
        return
    shown = [
        (
            row["game"],
            row["class"],
            str(row["agents"]),
            str(row["horizon"]),
            "" if row["social_cost"] is None else f"{row['social_cost']:.5g}",
            "" if row["gap"] is None else outward(row["gap"], ".1e", up=True),
            str(row["equilibria"]),
            row["best_player"] or "",
            "" if row["best_player"] is None else f"{row['player_cost'][0]:.4g}",
        )
        for row in rows
    ]
    known = ("social cost", "gap", "equilibria", "best player", "its cost")
    columns = ("game", "class", "agents", "horizon", *known)
    print_table(f"{len(rows)} games", columns, shown, texts=2)


def _row(instance: Instance) -> dict[str, Any]:
    record, game = instance.record, instance.tables["game"]
    return {
        "game": instance.name,
        "class": instance.difficulty,
        "agents": len(instance.tables["agent"]),
        "obstacles": len(instance.tables.get("obstacle", ())),
        "horizon": game["horizon"],
        "objective": game["objective"],
        "collisions": game["collisions"],
        "on_goal": game["on_goal"],
        "social_cost": None if record.social is None else record.value,
        "bound": None if record.bound is None else record.bound["value"],
        "gap": None if record.gap == float("inf") else record.gap,
        "equilibria": len(record.equilibria),
        "best_player": (best := record.best_player),
        "player_cost": None if best is None else record.players[best]["cost"],
    }


def _key(row: dict[str, Any], sort: str) -> tuple[Any, ...]:
    first = float("inf") if row.get(sort) is None else row.get(sort)
    return (row["game"],) if sort == "name" else (first, row["game"])


@with_group("selection", Selection)
def show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A game.")],
    *,
    selection: Selection,
    as_json: JsonOption = False,
) -> None:
    """Show the file of a game and its record; --json includes the plans."""
    from dataclasses import asdict

    from benchmarks.library.judge import recorded_plans

    instance = selected_one(name, selection)
    record = instance.record
    if as_json:
        print_json(_row(instance) | {"file": str(instance.path), "record": asdict(record)})
        return
    rows = [
        (what, f"{entry['social_cost']:.6g}", *_origin(entry["provenance"]))
        for what, entry in recorded_plans(record).items()
    ]
    if record.bound is not None:
        origin = _origin(record.bound["provenance"])
        rows.append(("proved bound", f"{record.bound['value']:.6g}", *origin))
    limits = record.risk.get("social")
    note = f"{instance.path}; class {instance.difficulty}"
    if limits is not None:
        low, high = outward(limits[0], ".1e", up=False), outward(limits[1], ".1e", up=True)
        note += f"; probability of any crash of the social plan: {low} to {high}"
    print_table(instance.name, ("entry", "social cost", "by", "date"), rows, note)
    players = sorted(record.players.items(), key=lambda pair: float(pair[1]["cost"][0]))
    if players:
        title = "Players in the environment; cost and regret per agent, crashes of any; 95 %"
        print_table(title, PLAYER_COLUMNS, [player_row(*pair) for pair in players], texts=2)


def _origin(provenance: dict[str, Any]) -> tuple[str, str]:
    return str(provenance.get("by", "")), str(provenance.get("date", ""))
