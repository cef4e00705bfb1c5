"""``ppg render``: a picture or a page of a plan, or a picture of a game before any agent moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.options import JsonOption, SeedOption, named_game, with_game_options
from benchmarks.terminal import print_json, print_note
from ppg_env.errors import require

if TYPE_CHECKING:
    from ppg_env.game.game import Game
    from ppg_env.game.plan import Profile


@with_game_options
def render(
    target: Annotated[
        str, typer.Argument(metavar="PLAN|GAME", help="A plan file (.json), or a game.")
    ],
    *,
    out: Annotated[
        str | None,
        typer.Option(
            metavar="PICTURE",
            help="Where to write the picture: .png, .svg or .pdf (default plan.png).",
        ),
    ] = None,
    html: Annotated[
        str | None,
        typer.Option(metavar="HTML", help="Write a page that plays the plan, for a browser."),
    ] = None,
    times: Annotated[
        str | None,
        typer.Option(metavar="T,T,...", help="Draw a panel of a plan for each of these times."),
    ] = None,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
    overrides: dict[str, Any],
) -> None:
    """Draw a plan: paths, bodies at a few times, noise ellipses, arrivals; or play it on a page."""
    from benchmarks.comparison.viewer import write_viewer
    from benchmarks.figures import PICTURES
    from ppg_env.support.atomic_write import check_target

    picture = out or (None if html else "plan.png")
    if picture is not None:
        check_target(picture, *PICTURES)
    if html is not None:
        check_target(html, ".html")
    game, profile, stored = _subject(target, overrides)
    written = {}
    if html is not None:
        require(profile is not None, "--html", "is for plans", "give a file of ppg solve --out")
        assert profile is not None
        write_viewer(game, profile, html)
        written["page"] = html
    if picture is not None:
        _draw(game, profile, picture, times)
        written["picture"] = picture
    if not as_json:
        for kind, path in written.items():
            typer.echo(f"{kind}: {path}")
    if profile is not None:
        _report(game, profile, stored, written, as_json=as_json)
    elif as_json:
        print_json(written)


def _subject(target: str, overrides: dict[str, Any]) -> tuple[Game, Profile | None, dict[str, Any]]:
    """Return the game, the profile and the claims of a plan file; a game has neither."""
    from ppg_env.formats.plan_file import read_plan

    if not target.endswith(".json"):
        return named_game(target, overrides), None, {}
    require(
        not overrides,
        "--" + next(iter(overrides), "").replace("_", "-"),
        "is for games",
        "leave it out, since a plan carries its game",
    )
    return read_plan(target)


def _draw(game: Game, profile: Profile | None, picture: str, times: str | None) -> None:
    from benchmarks.comparison.pictures import profile_picture
    from benchmarks.comparison.snapshots import snapshots_picture
    from benchmarks.sweeps.grid import whole_numbers

    if times is None:
        profile_picture(game, profile, picture)
        return
    require(profile is not None, "--times", "is for plans", "draw a file of ppg solve --out")
    assert profile is not None
    snapshots_picture(game, profile, whole_numbers("--times", times), picture)


def _report(
    game: Game, profile: Profile, stored: dict[str, Any], written: dict[str, str], *, as_json: bool
) -> None:
    """Print what is impossible in the plan, and where its file claims something else."""
    from benchmarks.comparison.claims import claims_note, different_claims
    from benchmarks.comparison.overlaps import between_steps_note, between_steps_report
    from ppg_env.game.evaluation import evaluate

    evaluation = evaluate(game, profile)
    if as_json:
        report = {
            "complaints": list(evaluation.violations()),
            "between_steps": between_steps_report(game, profile),
            "different_claims": different_claims(stored, evaluation),
        }
        print_json({**written, **report})
        return
    for violation in evaluation.violations():
        print_note(f"not possible: {violation}")
    print_note(between_steps_note(game, {"": profile}))
    print_note(claims_note(stored, evaluation))
