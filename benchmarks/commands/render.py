"""``ppg render``: a picture of a plan, or of a game before any agent moves."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from benchmarks.options import JsonOption, SeedOption, named_game, with_game_options
from benchmarks.terminal import print_json, print_note


@with_game_options
def render(
    target: Annotated[
        str, typer.Argument(metavar="PLAN|GAME", help="A plan file (.json), or a game.")
    ],
    *,
    out: Annotated[
        str, typer.Option(metavar="PICTURE", help="Where to write the picture: .png, .svg or .pdf.")
    ] = "plan.png",
    times: Annotated[
        str | None,
        typer.Option(metavar="T,T,...", help="Draw a panel of a plan for each of these times."),
    ] = None,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
    overrides: dict[str, Any],
) -> None:
    """Draw a plan: paths, bodies at a few times, noise ellipses, arrivals."""
    from benchmarks.comparison.claims import claims_note, different_claims
    from benchmarks.comparison.overlaps import between_steps_note, between_steps_report
    from benchmarks.comparison.pictures import profile_picture
    from benchmarks.comparison.snapshots import snapshots_picture
    from benchmarks.figures import PICTURES
    from benchmarks.sweeps.grid import whole_numbers
    from ppg_env.errors import require
    from ppg_env.formats.plan_file import read_plan
    from ppg_env.game.evaluation import evaluate
    from ppg_env.support.atomic_write import check_target

    check_target(out, *PICTURES)
    if target.endswith(".json"):
        require(
            not overrides,
            "--" + next(iter(overrides), "").replace("_", "-"),
            "is for games",
            "leave it out, since a plan carries its game",
        )
        game, profile, stored = read_plan(target)
    else:
        game, profile, stored = named_game(target, overrides), None, {}
    if times is None:
        profile_picture(game, profile, out)
    else:
        require(profile is not None, "--times", "is for plans", "draw a file of ppg solve --out")
        assert profile is not None
        snapshots_picture(game, profile, whole_numbers("--times", times), out)
    if profile is None:
        print_json({"picture": out}) if as_json else typer.echo(f"picture: {out}")
        return
    evaluation = evaluate(game, profile)
    if as_json:
        report = {
            "complaints": list(evaluation.violations()),
            "between_steps": between_steps_report(game, profile),
            "different_claims": different_claims(stored, evaluation),
        }
        print_json({"picture": out, **report})
        return
    typer.echo(f"picture: {out}")
    for violation in evaluation.violations():
        print_note(f"not possible: {violation}")
    print_note(between_steps_note(game, {"": profile}))
    print_note(claims_note(stored, evaluation))
