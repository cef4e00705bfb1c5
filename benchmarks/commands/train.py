"""``ppg train``: learned players for a game."""

from __future__ import annotations

import inspect
import shlex
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.interrupt import keep
from benchmarks.options import (
    GameArgument,
    JobsOption,
    JsonOption,
    SeedOption,
    ToleranceOption,
    named_game,
    with_game_options,
    with_group,
)
from benchmarks.terminal import bar, interval, print_json, print_table

if TYPE_CHECKING:
    from baselines import Learned
    from ppg_env.env.randomize import Randomize
    from ppg_env.game.game import Game


@dataclass(frozen=True)
class Training:
    """How players are trained."""

    method: Annotated[
        str,
        typer.Option(
            metavar="shared|independent|best-response|off-policy",
            help="One PPO policy for all agents; one for each agent, trained together; one for "
            "each, trained in turns against the frozen others; SAC for one agent.",
        ),
    ] = "shared"
    sharing: Annotated[
        str, typer.Option(metavar="selfish|social", help="Own rewards, or the sum of all.")
    ] = "selfish"
    lam_range: Annotated[
        str,
        typer.Option(
            metavar="LOW,HIGH", help="Lam is drawn from here and observed, unless --lam is given."
        ),
    ] = "0.05,0.95"
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Environment steps of each run (default: the method's)."),
    ] = None
    tolerance: ToleranceOption = None
    warm_start: Annotated[
        str,
        typer.Option(
            metavar="straight|feedback",
            help="What the network imitates first: straight ways, or the players of "
            "'ppg feedback' (optimum if social, equilibrium if selfish).",
        ),
    ] = "straight"
    randomize: Annotated[
        str | None,
        typer.Option(
            metavar="TOML",
            help="File with a table [randomize]: what every episode draws, and agents observe.",
        ),
    ] = None
    seeds: Annotated[int, typer.Option(min=1, help="Runs, with seeds from --seed on.")] = 1
    jobs: JobsOption = 1
    out: Annotated[
        str | None, typer.Option(metavar="NPZ", help="File (default out/GAME-PLAYER.npz).")
    ] = None
    tensorboard: Annotated[
        str | None, typer.Option(metavar="FOLDER", help="Folder of TensorBoard logs.")
    ] = None


@with_game_options
@with_group("training", Training)
def train(
    game: GameArgument,
    *,
    training: Training,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
    overrides: dict[str, Any],
) -> None:
    """Train players with stable-baselines3; continues from its checkpoint after a kill."""
    from baselines.policy_file import write_learned
    from baselines.train import check_randomize, check_warm_start, player_name
    from benchmarks.output_paths import target
    from ppg_env.env.rules import Rules
    from ppg_env.errors import placed
    from ppg_env.game.between_steps import overlap_times

    lam = _check(training)
    instance = named_game(game, overrides)
    rule = _rule(training)
    if rule is not None:
        with placed(f"--randomize {training.randomize}", ": "):
            check_randomize(
                rule, instance, Rules(tolerance=training.tolerance), training.warm_start
            )
    check_warm_start(
        training.warm_start, training.method, instance, training.tolerance, "--warm-start"
    )
    player = player_name(training.method, training.sharing, training.warm_start)
    path = target(f"{game}-{player}", training.out, ".npz")
    folder = Path(f"{path}.checkpoints")
    keep(f"checkpoints in {folder} are kept, and the same command continues from them")
    lam_range = None if "lam" in overrides else lam
    learned = _train(instance, game, training, seed, lam_range, rule, folder)
    learned.about["command"] = _command(game, overrides, training, seed)
    write_learned(path, learned)
    for file in folder.glob("seed-*.pt"):
        file.unlink()
    folder.rmdir()
    typer.echo(f"wrote {path}", err=True)
    if as_json:
        print_json({"path": path, **{k: v for k, v in learned.about.items() if k != "game"}})
    else:
        _print(learned, game, training.seeds, overlap_times(instance))


def _check(training: Training) -> tuple[float, float]:
    """Refuse unknown choices, and return the range of lam."""
    from baselines.train import METHODS
    from benchmarks.options import numbers
    from ppg_env.env.rules import CHOICES
    from ppg_env.errors import InputError, require

    method, sharing = training.method, training.sharing
    require(method in METHODS, "--method", f"is {method!r}", "write " + ", ".join(METHODS))
    known = CHOICES["sharing"]
    require(sharing in known, "--sharing", f"is {sharing!r}", "write " + " or ".join(known))
    lam = numbers("lam-range", training.lam_range)
    if not isinstance(lam, list) or len(lam) != 2:
        raise InputError(
            "--lam-range", f"is {training.lam_range!r}", "write two numbers, as in 0.05,0.95"
        )
    return lam[0], lam[1]


def _rule(training: Training) -> Randomize | None:
    """Return the rule of random draws; refuse a range of lam where the rule draws it."""
    from ppg_env.env.rule_tables import read_randomize
    from ppg_env.errors import require

    rule = None if training.randomize is None else read_randomize(training.randomize)
    require(
        rule is None or rule.lam is None or training.lam_range == Training.lam_range,
        "--lam-range",
        f"and {training.randomize} both draw lam",
        "give only one of them",
    )
    return rule


def _train(
    instance: Game,
    game: str,
    training: Training,
    seed: int,
    lam: tuple[float, float] | None,
    rule: Randomize | None,
    folder: Path,
) -> Learned:
    from baselines.train import METHODS, train_players

    if any(folder.glob("*.pt")):
        typer.echo(f"continuing from the checkpoints in {folder}", err=True)
    total = (training.steps or METHODS[training.method].steps) * training.seeds
    with bar(f"training in {game}", total) as advance:
        return train_players(
            instance,
            training.method,
            sharing=training.sharing,
            lam=lam,
            tolerance=training.tolerance,
            warm_start=training.warm_start,
            randomize=rule,
            seeds=range(seed, seed + training.seeds),
            steps=training.steps,
            jobs=training.jobs,
            folder=folder,
            tensorboard=Path(training.tensorboard) if training.tensorboard else None,
            progress=advance,
            activity=advance,
        )


def _command(game: str, overrides: dict[str, Any], training: Training, seed: int) -> str:
    """Return the command that repeats the training; options with default values are left out."""
    elsewhere = ("jobs", "out", "tensorboard")
    names = [field.name for field in fields(Training) if field.name not in elsewhere]
    options = overrides | {name: getattr(training, name) for name in names}
    options |= {"seed": seed, "out": training.out}
    defaults = inspect.signature(train).parameters
    words = ["ppg", "train", game]
    for name, value in options.items():
        if value != defaults[name].default:
            values = value if isinstance(value, list) else [value]
            words += [f"--{name.replace('_', '-')}", ",".join(map(str, values))]
    return shlex.join(words)


def _print(learned: Learned, game: str, seeds: int, crashes: str) -> None:
    from ppg_env.support.statistics import Interval

    rows = []
    for row in learned.about["figures"]:
        lams = " ".join(f"{lam:g}" for lam in sorted(set(row["lam"]))) or "drawn"
        keys = ("expected_cost", "crash_probability", "success")
        rows.append((lams, *(interval(Interval(**row[key]), ".4g", ".4g") for key in keys)))
    print_table(
        f"{learned.name} in {game}: {seeds} x {learned.about['steps']:,} steps",
        ("lam", "expected cost", "crash probability", "arrived"),
        rows,
        "In the environment, without exploration; mean cost of agents; crash: overlap "
        f"{crashes}; 95 % intervals over runs.",
    )
