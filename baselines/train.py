"""Train players by method name over several seeds, and collect them in one :class:`Learned`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from baselines.figures import figures
from baselines.policy import Team
from baselines.policy_file import Learned
from baselines.workers import reporting_map
from ppg_env.env.arrays import make_tables
from ppg_env.env.randomize import Randomize
from ppg_env.env.rule_checks import check_rule
from ppg_env.env.rule_tables import randomize_to_table
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import game_to_tables
from ppg_env.game.game import Game
from ppg_env.support.processes import alone_on
from solvers.feedback.grid.extent import dynamic_programming_applies

if TYPE_CHECKING:
    from baselines.training_loop import Activity, Args, Progress


@dataclass(frozen=True)
class Method:
    """A training method: prefix of its players' names, its function, and sufficient steps."""

    prefix: str
    module: str
    function: str
    steps: int


METHODS = {
    "shared": Method("ppo", "baselines.ppo_shared", "train", 2_000_000),
    "independent": Method("ippo", "baselines.ppo_per_agent", "independent", 2_000_000),
    "best-response": Method("ibr", "baselines.ppo_per_agent", "best_response", 2_000_000),
    "off-policy": Method("sac", "baselines.sac_single", "train", 100_000),
}

WARM_STARTS = ("straight", "feedback")
"""What a network imitates first: straight ways, or players made by dynamic programming."""

PACKAGES = ("path-planning-games", "stable-baselines3", "torch", "numpy", "gymnasium")


class TrainingOptions(TypedDict, total=False):
    """Options of :func:`train_players` that :class:`baselines.training_loop.Args` describes."""

    sharing: str
    lam: tuple[float, float] | None
    tolerance: float | None
    randomize: Randomize | None
    tensorboard: Path | None


def train_players(
    game: Game,
    method: str = "shared",
    *,
    warm_start: str = "straight",
    seeds: Sequence[int] = (0,),
    steps: int | None = None,
    jobs: int = 1,
    folder: Path | None = None,
    progress: Progress = lambda _steps: None,
    activity: Activity = lambda _text: None,
    **options: Unpack[TrainingOptions],
) -> Learned:
    """Train one run per seed, and evaluate the runs.

    Parameters
    ----------
    game, steps, **options
        See :class:`baselines.training_loop.Args`, whose ``sharing``, ``lam``, ``tolerance``,
        ``randomize`` and ``tensorboard`` are options; ``steps`` defaults to those of the method.
        If ``randomize`` draws lam, ``lam`` has no effect.
    method
        A name of :data:`METHODS`.
    warm_start
        What the networks imitate first, a name of :data:`WARM_STARTS`.
    jobs
        Processes; results do not depend on them.
    folder
        Folder of checkpoints, ``seed-<s>.pt``; a training that was killed continues from them.
        Another training in the same folder is refused.
    progress
        Called with the environment steps taken since the last call.
    activity
        Called with what a training does before its first step, which may take minutes.
    """
    require(method in METHODS, "method", f"is {method!r}", "write " + ", ".join(METHODS))
    require(len(seeds) > 0, "seeds", "are none", "train with at least one")
    tolerance, rule = options.get("tolerance"), options.get("randomize")
    check_warm_start(warm_start, method, game, tolerance)
    if rule is not None:
        check_randomize(rule, game, Rules(tolerance=tolerance), warm_start)
        if rule.lam is not None:
            options["lam"] = None
    require_extra()
    from baselines.training_loop import Args

    steps = METHODS[method].steps if steps is None else steps
    args = Args(game, steps=steps, imitate_feedback=warm_start == "feedback", **options)
    each = [
        replace(args, seed=seed, checkpoint=folder and folder / f"seed-{seed}.pt") for seed in seeds
    ]
    for needed in (args.tensorboard, folder):  # the second is temporary, and comes last
        if needed is not None:
            _make_folder(needed)
    other = "wait for the other training, or name another place for this one"
    lock = nullcontext() if folder is None else alone_on(folder / "lock", other)
    with lock, reporting_map(jobs, progress, activity) as run:
        runs = tuple(run(partial(_train, method), each))
    learned = Learned(runs, _about(method, args, seeds))
    learned.about["figures"] = figures(game, learned, rules=args.rules, randomize=rule)
    return learned


def player_name(method: str, sharing: str, warm_start: str = "straight") -> str:
    """Return the name of trained players, such as ``ppo-selfish`` or ``ppo-warm-selfish``."""
    warm = "-warm" if warm_start == "feedback" else ""
    return f"{METHODS[method].prefix}{warm}-{sharing}"


def check_warm_start(
    warm_start: str,
    method: str,
    game: Game,
    tolerance: float | None = None,
    place: str = "warm_start",
) -> None:
    """Refuse an unknown ``warm_start``, or feedback players where there are none."""
    require(
        warm_start in WARM_STARTS, place, f"is {warm_start!r}", "write " + " or ".join(WARM_STARTS)
    )
    if warm_start == "feedback":
        require(method != "off-policy", place, "has no effect for off-policy", "use another method")
        require(
            dynamic_programming_applies(game, Rules(tolerance=tolerance)),
            place,
            "needs a game whose joint state has at most four dimensions",
            "use straight",
        )


def check_randomize(
    rule: Randomize, game: Game, rules: Rules, warm_start: str = "straight"
) -> None:
    """Refuse a rule that does not fit ``game``, or that feedback players cannot follow."""
    require(
        warm_start == "straight",
        "randomize",
        "draws games for which there are no feedback players to imitate",
        "use the warm start straight",
    )
    check_rule(rule, game, make_tables(game, rules.of(game)))


def _about(method: str, args: Args, seeds: Sequence[int]) -> dict[str, Any]:
    """Return what a file says of its training."""
    warm_start = WARM_STARTS[args.imitate_feedback]
    return {
        "player": player_name(method, args.sharing, warm_start),
        "method": method,
        "sharing": args.sharing,
        "reward": "risk",
        "lam": None if args.lam is None else list(args.lam),
        "tolerance": args.tolerance,
        "warm_start": warm_start,
        "seeds": list(seeds),
        "steps": args.steps,
        **_drawn(args.randomize),
        "versions": {name: _version(name) for name in PACKAGES},
        "game": game_to_tables(args.game),
    }


def _drawn(rule: Randomize | None) -> dict[str, Any]:
    return {} if rule is None else {"randomize": randomize_to_table(rule)}


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            str(path), f"cannot be a folder ({error.strerror})", "choose another place"
        ) from None


def require_extra() -> None:
    """Raise an InputError that names the missing extra, if training cannot be imported."""
    from importlib.util import find_spec

    if find_spec("stable_baselines3") is None:
        raise InputError(
            "stable-baselines3",
            "is not installed, and training needs it",
            "install the extra 'rl', as in pip install -c constraints.txt -e '.[rl]'",
        )


def _train(method: str, args: Args, progress: Progress, activity: Activity) -> Team:
    train = getattr(import_module(METHODS[method].module), METHODS[method].function)
    team: Team = train(args, progress, activity)
    return team


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
