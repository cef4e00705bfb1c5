"""``ppg library track``: learned tracks, their rankings, and new entries."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import JsonOption, with_group
from benchmarks.terminal import interval, print_json, print_table, working

if TYPE_CHECKING:
    from benchmarks.library.learned.track import Track

COLUMNS = ("player", "test score", "beyond", "trainings", "by", "date")


@dataclass(frozen=True)
class TrackOptions:
    """Who plays, and what is kept."""

    player: Annotated[
        str | None,
        typer.Option(metavar="PLAYER", help="A .py or .npz file, or a player of 'ppg compare'."),
    ] = None
    episodes: Annotated[
        int, typer.Option(min=100, help="Episodes of each training in each game.")
    ] = 5_000
    time_limit: Annotated[
        float | None, typer.Option(min=0.0, metavar="S", help="Seconds for each plan or policy.")
    ] = None
    label: Annotated[
        str | None, typer.Option(metavar="NAME", help="Name on the track (the player).")
    ] = None
    by: Annotated[str, typer.Option(metavar="NAME", help="The author that the entry names.")] = ""
    improve: Annotated[bool, typer.Option("--submit", help="Keep the entry on the track.")] = False
    tracks: Annotated[
        str | None, typer.Option(metavar="FOLDER", help="Folder of the tracks (the checkout's).")
    ] = None


@with_group("options", TrackOptions)
def track(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="A track; none to list all of them.")
    ] = None,
    *,
    options: TrackOptions,
    as_json: JsonOption = False,
) -> None:
    """List learned tracks, show the ranking of one, or score a player on it."""
    from benchmarks.library.learned.entries import evaluated, offer, ranked, read_entries
    from benchmarks.library.learned.track import FOLDER, find_track, tracks
    from ppg_env.errors import require

    folder = FOLDER if options.tracks is None else Path(options.tracks)
    if name is None:
        require(options.player is None, "NAME", "is missing", "name a track, or no --player")
        _list(tracks(folder), as_json)
        return
    chosen = find_track(name, folder)
    entries, kept = read_entries(chosen)["entries"], False
    if options.player is not None:
        by = options.by.strip()[:100]
        require(bool(by) or not options.improve, "--by", "is missing", "name who made the player")
        label = (options.label or Path(options.player).stem)[:60]
        with working(f"{label} in the games of {chosen.name}"):
            entry = evaluated(
                chosen,
                options.player,
                label=label,
                by=by or "this run",
                episodes=options.episodes,
                limit=options.time_limit,
            )
        kept = options.improve and offer(chosen, entry)
        others = [known for known in entries if known["player"] != label or not kept]
        entries = ranked([*others, entry])
    if as_json:
        print_json({"track": chosen.name, "kept": kept, "entries": entries})
        return
    about, counts = chosen.about, [len(chosen.games(split)) for split in ("test", "beyond")]
    note = (
        f"{counts[0]} test games and {counts[1]} beyond the training rule; 0 is straight flight, "
        f"100 {about['reference']}; 95 % over trainings"
    )
    print_table(chosen.name, COLUMNS, [entry_row(entry) for entry in entries], note)
    if options.improve and not kept:
        typer.echo(f"not kept: {label} has an entry with a score as high", err=True)


def entry_row(entry: dict[str, Any]) -> tuple[str, ...]:
    """Return the cells of an entry: :data:`COLUMNS`."""
    from ppg_env.support.statistics import Interval

    nan = float("nan")
    cells = [
        interval(Interval(*(nan if x is None else x for x in entry["scores"][split])), ".2f", ".2f")
        for split in ("test", "beyond")
    ]
    origin = entry["provenance"]
    return entry["player"], *cells, str(entry["runs"]), entry["by"], str(origin.get("date", ""))


def _list(known: list[Track], as_json: bool) -> None:
    from benchmarks.library.learned.entries import read_entries

    rows = []
    for one in known:
        entries, about = read_entries(one)["entries"], one.about
        rows.append(
            {
                "track": one.name,
                "agents": len(one.game.agents),
                "games": len(about["games"]),
                "reference": about["reference"],
                "entries": len(entries),
                "best": entries[0]["player"] if entries else None,
                "score": entries[0]["scores"]["test"][0] if entries else None,
            }
        )
    if as_json:
        print_json({"tracks": rows})
        return
    shown = [
        tuple(
            "" if x is None else f"{x:.2f}" if isinstance(x, float) else str(x)
            for x in row.values()
        )
        for row in rows
    ]
    columns = ("track", "agents", "test games", "reference", "entries", "best entry", "score")
    print_table(f"{len(rows)} learned tracks", columns, shown)
