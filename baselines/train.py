"""Train players by name of method, over several seeds, into one :class:`Learned`."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from baselines.evaluate_runs import evaluate_runs, over_runs
from baselines.policy import Team
from baselines.policy_file import Learned
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import game_to_tables
from ppg_env.game.game import Game
from ppg_env.scenarios.make import override_game

if TYPE_CHECKING:
    from baselines.training_loop import Args, Progress


@dataclass(frozen=True)
class Method:
    """A way to train: prefix of its players' names, its function, and how many steps are enough."""

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

FIGURE_LAMS = (0.2, 0.5, 0.8)
FIGURE_EPISODES = 50_000
"""What a trained player's file says of it: costs and crashes at these lam, so many episodes."""

PACKAGES = ("path-planning-games", "stable-baselines3", "torch", "numpy", "gymnasium")


def train_players(
    game: Game,
    method: str = "shared",
    *,
    sharing: str = "selfish",
    lam: tuple[float, float] | None = (0.05, 0.95),
    seeds: Sequence[int] = (0,),
    steps: int | None = None,
    jobs: int = 1,
    folder: Path | None = None,
    tensorboard: Path | None = None,
    progress: Progress = lambda _steps: None,
) -> Learned:
    """Train one run per seed, and measure what they do.

    Parameters
    ----------
    game, sharing, lam, steps, tensorboard
        See :class:`baselines.training_loop.Args`; what is enough for the method unless given.
    method
        A name of :data:`METHODS`.
    jobs
        Processes; results do not depend on them.
    folder
        Where checkpoints are kept, ``seed-<s>.pt``; a training that was killed goes on from there.
    """
    require(method in METHODS, "method", f"is {method!r}", "write " + ", ".join(METHODS))
    require(len(seeds) > 0, "seeds", "are none", "train with at least one")
    require_extra()
    from baselines.training_loop import Args

    steps = METHODS[method].steps if steps is None else steps
    args = Args(game, sharing, lam, steps=steps, tensorboard=tensorboard)
    each = [
        replace(args, seed=seed, checkpoint=folder and folder / f"seed-{seed}.pt") for seed in seeds
    ]
    for needed in (tensorboard, folder):  # the second is ours, and comes last
        if needed is not None:
            _make_folder(needed)
    with _progress_of(jobs, progress) as (run, tell):
        runs = tuple(run(partial(_train, method, tell), each))
    about: dict[str, Any] = {
        "player": f"{METHODS[method].prefix}-{sharing}",
        "method": method,
        "sharing": sharing,
        "reward": "risk",
        "lam": None if lam is None else list(lam),
        "seeds": list(seeds),
        "steps": steps,
        "versions": {name: _version(name) for name in PACKAGES},
        "game": game_to_tables(game),
    }
    learned = Learned(runs, about)
    about["figures"] = figures(game, learned)
    return learned


def figures(game: Game, learned: Learned, episodes: int = FIGURE_EPISODES) -> list[dict[str, Any]]:
    """Cost, crashes and arrivals at each lam of :data:`FIGURE_LAMS` that the policy knows."""
    low, high = learned.about["lam"] or (1.0, 0.0)
    lams: list[float | None] = [lam for lam in FIGURE_LAMS if low <= lam <= high]
    rows = []
    for lam in lams or [None]:
        played = game if lam is None else override_game(game, lam=lam)
        runs = [learned.players(played, r) for r in range(len(learned.runs))]
        judged = evaluate_runs(played, runs, episodes * len(runs), seed=0)
        rows.append(
            {
                "lam": [agent.lam for agent in played.agents],
                "episodes": episodes,
                "expected_cost": vars(over_runs(judged.costs, 0.0)),
                "crash_probability": vars(over_runs(judged.crashes, 0.0, 1.0)),
                "success": vars(over_runs(judged.successes, 0.0, 1.0)),
                "expected_cost_runs": judged.costs.tolist(),
                "crash_probability_runs": judged.crashes.tolist(),
                "success_runs": judged.successes.tolist(),
            }
        )
    return rows


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            str(path), f"cannot be a folder ({error.strerror})", "choose another place"
        ) from None


def require_extra() -> None:
    """Say which extra is missing, in one sentence, instead of an import error."""
    from importlib.util import find_spec

    if find_spec("stable_baselines3") is None:
        raise InputError(
            "stable-baselines3",
            "is not installed, and training needs it",
            "install the extra 'rl', as in pip install -c constraints.txt -e '.[rl]'",
        )


def _train(method: str, tell: Progress | None, args: Args) -> Team:
    train = getattr(import_module(METHODS[method].module), METHODS[method].function)
    team: Team = train(args, tell or _tell_parent)
    return team


_to_parent: Any = None


def _keep_queue(queue: Any) -> None:
    global _to_parent
    _to_parent = queue


def _tell_parent(steps: int) -> None:
    _to_parent.put(steps)


Run = Callable[[Callable[["Args"], Team], Sequence["Args"]], Iterator[Team]]


@contextmanager
def _progress_of(jobs: int, progress: Progress) -> Iterator[tuple[Run, Progress | None]]:
    """A ``map`` over trainings, here or in ``jobs`` processes that report their progress."""
    if jobs == 1:
        yield map, progress
        return
    context = multiprocessing.get_context("spawn")  # torch does not survive a fork
    queue = context.Queue()

    def listen() -> None:
        for steps in iter(queue.get, None):
            progress(steps)

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        with ProcessPoolExecutor(jobs, context, _keep_queue, (queue,)) as pool:
            yield pool.map, None
    finally:
        queue.put(None)
        listener.join()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
