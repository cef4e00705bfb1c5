"""``ppg library play``: players of games in the environment, and their entries in records."""

from __future__ import annotations

from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.commands.library_games import NamesArgument, Selection, selected
from benchmarks.commands.library_tables import PLAYER_COLUMNS, player_row
from benchmarks.options import JsonOption, SeedOption, with_group
from benchmarks.terminal import bar, print_json, print_table

if TYPE_CHECKING:
    from benchmarks.library.instance import Instance


@dataclass(frozen=True)
class PlayOptions:
    """Which players, how long they play, and what is kept."""

    players: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Players of 'ppg compare', files of players, nash and social of the record.",
        ),
    ] = "social,nash,costliest-nash,straight"
    episodes: Annotated[int, typer.Option(min=100, help="Episodes of each player.")] = 20_000
    deviation: Annotated[
        str | None,
        typer.Option(metavar="grid,planned", help="Bound regrets by these deviations, too."),
    ] = None
    time_limit: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="S", help="Seconds for each plan, policy or deviation."),
    ] = None
    budget: Annotated[
        float | None, typer.Option(metavar="S", help="Start no player after so many seconds.")
    ] = None
    label: Annotated[
        str | None, typer.Option(metavar="NAME", help="Name in the record (the player).")
    ] = None
    by: Annotated[
        str, typer.Option(metavar="NAME", help="Whom or what the record names as the author.")
    ] = ""
    improve: Annotated[bool, typer.Option("--submit", help="Put the players into the records.")] = (
        False
    )


@with_group("selection", Selection)
@with_group("options", PlayOptions)
def play(
    names: NamesArgument = None,
    *,
    selection: Selection,
    options: PlayOptions,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Simulate players of games in the environment; --submit continues where it was stopped."""
    players = _checked_players(options)
    games, rows, started = selected(names, selection), [], monotonic()
    with bar(f"players over {len(games)} games", len(games)) as advance:
        for instance in games:
            for name in players:
                if options.budget is None or monotonic() - started <= options.budget:
                    rows += _played(instance, name, options, seed, alone=len(games) == 1)
            advance(1)
    if as_json:
        print_json({"rows": rows})
        return
    for row in rows:
        if "refused" in row:
            typer.echo(f"{row['game']} {row['player']}: {row['refused']}", err=True)
    shown = [(row["game"], *player_row(row["player"], row)) for row in rows if "cost" in row]
    print_table(f"{len(shown)} players", ("game", *PLAYER_COLUMNS), shown, texts=3)


def _checked_players(options: PlayOptions) -> list[str]:
    """Return the names of the players; refuse options that do not fit together."""
    from baselines.deviations import check_deviation
    from benchmarks.library.team import RECORDED, check_player
    from ppg_env.errors import require

    names = [name.strip() for name in options.players.split(",")]
    for name in names:
        check_player(name)
    for deviation in _deviations(options):
        check_deviation(deviation, "--deviation")
    ours = all(name in RECORDED for name in names)
    by = not options.improve or ours or bool(options.by.strip())
    require(by, "--by", "is missing", "name who or what made the players")
    require(
        options.label is None or (len(names) == 1 and options.label not in RECORDED),
        "--label",
        f"is {options.label}",
        "name one player, and no plan of the record",
    )
    return names


def _deviations(options: PlayOptions) -> list[str]:
    return [] if options.deviation is None else options.deviation.split(",")


def _played(
    instance: Instance, name: str, options: PlayOptions, seed: int, *, alone: bool
) -> list[dict[str, Any]]:
    """Play one player, and return its row; none if there is nothing to play.

    A player that the game does not have is a row, too, and an error if the game is ``alone``.
    """
    from benchmarks.library.play import is_current, play
    from benchmarks.library.record import write_record
    from ppg_env.errors import InputError

    label, deviations = options.label or name, _deviations(options)
    if options.improve and is_current(instance, label, options.episodes, seed, deviations):
        return []
    head = {"game": instance.name, "player": label}
    try:
        entry = play(
            instance,
            name,
            options.episodes,
            by=options.by.strip()[:100] or "ppg",
            seed=seed,
            deviations=deviations,
            limit=options.time_limit,
        )
    except InputError as error:
        if alone:
            raise
        return [head | {"refused": str(error)}]
    if entry is None:
        return []
    if options.improve:
        instance.record.offer_player(label, entry)
        write_record(instance.record_path, instance.record)
    return [head | entry]
