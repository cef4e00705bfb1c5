"""``ppg train``: learned players for a game."""

from __future__ import annotations

import inspect
import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from benchmarks.options import GameArgument, JsonOption, SeedOption, with_game_options
from benchmarks.terminal import bar, print_json, print_table


@with_game_options
def train(
    game: GameArgument,
    overrides: dict[str, Any],
    method: Annotated[
        str,
        typer.Option(
            metavar="shared|independent|best-response|off-policy",
            help="Who learns what: one PPO policy for all; one each, together; one each, in "
            "turns against the frozen others; SAC for one agent.",
        ),
    ] = "shared",
    sharing: Annotated[
        str, typer.Option(metavar="selfish|social", help="Own rewards, or everybody's.")
    ] = "selfish",
    lam_range: Annotated[
        str,
        typer.Option(
            metavar="LOW,HIGH", help="Lam is drawn from here and observed, unless --lam is given."
        ),
    ] = "0.05,0.95",
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Environment steps of each run (default: the method's)."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Runs, with seeds from --seed on.")] = 1,
    jobs: Annotated[int, typer.Option(min=1, help="Processes, one run each.")] = 1,
    out: Annotated[
        str | None, typer.Option(metavar="NPZ", help="File (default out/GAME-PLAYER.npz).")
    ] = None,
    tensorboard: Annotated[
        str | None, typer.Option(metavar="FOLDER", help="Write TensorBoard logs there.")
    ] = None,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Train players with stable-baselines3; goes on where it was when it was killed."""
    from baselines.policy_file import write_learned
    from baselines.train import METHODS, train_players
    from benchmarks.options import numbers
    from benchmarks.output_paths import target
    from ppg_env.env.rules import CHOICES
    from ppg_env.errors import require
    from ppg_env.scenarios.make import make_game

    require(method in METHODS, "--method", f"is {method!r}", "write " + ", ".join(METHODS))
    require(
        sharing in CHOICES["sharing"],
        "--sharing",
        f"is {sharing!r}",
        "write " + " or ".join(CHOICES["sharing"]),
    )
    drawn = numbers("lam-range", lam_range)
    require(
        isinstance(drawn, list) and len(drawn) == 2,
        "--lam-range",
        f"is {lam_range!r}",
        "write two numbers, as in 0.05,0.95",
    )
    assert isinstance(drawn, list)
    made = make_game(game, **overrides)
    path = target(f"{game}-{METHODS[method].prefix}-{sharing}", ".npz", out)
    kept = Path(f"{path}.checkpoints")
    if any(kept.glob("*.pt")):
        typer.echo(f"going on from the checkpoints in {kept}", err=True)
    total = (steps or METHODS[method].steps) * seeds
    with bar(f"training in {game}", total) as advance:
        learned = train_players(
            made,
            method,
            sharing=sharing,
            lam=None if "lam" in overrides else (drawn[0], drawn[1]),
            seeds=range(seed, seed + seeds),
            steps=steps,
            jobs=jobs,
            folder=kept,
            tensorboard=Path(tensorboard) if tensorboard else None,
            progress=advance,
        )
    given = {"method": method, "sharing": sharing, "lam_range": lam_range, "steps": steps}
    given |= {"seeds": seeds, "seed": seed, "out": out}
    learned.about["command"] = _command(game, overrides | given)
    write_learned(path, learned)
    for file in kept.glob("seed-*.pt"):
        file.unlink()
    kept.rmdir()
    typer.echo(f"wrote {path}", err=True)
    if as_json:
        print_json({"path": path, **{k: v for k, v in learned.about.items() if k != "game"}})
        return
    rows = [
        (
            " ".join(f"{lam:g}" for lam in sorted(set(row["lam"]))),
            *(_interval(row[key]) for key in ("expected_cost", "crash_probability", "success")),
        )
        for row in learned.about["figures"]
    ]
    print_table(
        f"{learned.name} in {game}: {seeds} x {learned.about['steps']:,} steps",
        ("lam", "expected cost", "crash probability", "arrived"),
        rows,
        "In the environment, without exploration. Cost: mean over agents. Intervals: 95 %, over "
        "runs.",
    )


def _command(game: str, options: dict[str, Any]) -> str:
    """The command that repeats the training; options that stand as they are by default left out."""
    defaults = inspect.signature(train).parameters
    words = ["ppg", "train", game]
    for name, value in options.items():
        if value != defaults[name].default:
            values = value if isinstance(value, list) else [value]
            words += [f"--{name.replace('_', '-')}", ",".join(str(one) for one in values)]
    return shlex.join(words)


def _interval(found: dict[str, float]) -> str:
    if found["low"] != found["low"]:
        return f"{found['value']:.4g}"
    return f"{found['value']:.4g} [{found['low']:.4g}, {found['high']:.4g}]"
