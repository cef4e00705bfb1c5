"""The figures of a trained policy, next to those of the package's ``ppo-selfish``.

All players are simulated by the evaluator of ``ppg compare``, in the game itself and with common
random numbers: what a library reports of its training (shaped, scaled, with exploration) is not
comparable between libraries.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from baselines import evaluate_runs, find_pretrained
from ppg_env.env.players import Player, View
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.game import Game
from ppg_env.game.input_sets import bounds

if TYPE_CHECKING:  # loaded from elsewhere, this file has no neighbours
    from task import Task

EPISODES, ROUGH_EPISODES = 20_000, 2_000
COLUMNS = ("player", "steps", "CPU s", "expected cost", "crash probability", "arrived %")
WIDTHS = (30, 9, 7, 16, 32, 9)

Act = Callable[[int, np.ndarray], np.ndarray]
"""Actions (C, m) from -1 to 1 of an agent, by index, for its observations (C, W) in C copies."""


class TrainedPlayer:
    """Plays ``act`` for one agent, from observations alone and without exploration."""

    information = "full state"

    def __init__(self, game: Game, agent: int, act: Act) -> None:
        low, high = bounds(game.agents[agent].control)
        self._middle, self._half = (high + low) / 2, (high - low) / 2
        self._agent, self._act = agent, act

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m) in the units of the game."""
        action = np.asarray(self._act(self._agent, view.observation), dtype=np.float64)
        return self._middle + self._half * np.clip(action, -1.0, 1.0)


def report(name: str, task: Task, act: Act, *, steps: int, seconds: float) -> None:
    """Print a row for the trained policies and, for trainings, one for ``ppo-selfish``.

    ``steps`` are the steps of all agents in training, ``seconds`` its CPU time.
    """
    game, rules = task.game, Rules(**task.rules) if task.rules else None
    players = [TrainedPlayer(game, i, act) for i in range(len(game.agents))]
    name = f"{name} {task.rough}".rstrip()
    print(line(COLUMNS))
    print(row(name, game, [players], f"{steps:,}", f"{seconds:.0f}", rules=rules), flush=True)
    if task.rough:
        return
    try:
        learned = find_pretrained("ppo-selfish", game)
    except InputError:  # not for this game
        return
    runs = [learned.players(game, run) for run in range(len(learned.runs))]
    print(row(learned.name, game, runs, f"{learned.about['steps']:,}", ""), flush=True)


def row(
    name: str,
    game: Game,
    runs: Sequence[Sequence[Player]],
    *training: str,
    rules: Rules | None = None,
) -> str:
    """Return the row of a player: its name, its training, and its figures as intervals."""
    episodes = EPISODES if rules is None else ROUGH_EPISODES
    statistics = evaluate_runs(game, runs, episodes, seed=0, rules=rules)
    summary = statistics.summary
    cost, crash = summary.cost_mean, summary.crash_any
    arrived = 100 * float(np.mean(statistics.successes))
    return line(
        (
            name,
            *training,
            f"{cost.value:.3f} ± {cost.high - cost.value:.3f}",
            f"{crash.value:.2e} [{crash.low:.1e}, {crash.high:.1e}]",
            f"{arrived:.1f}",
        )
    )


def line(cells: Sequence[str]) -> str:
    """Return a line of the table; only its first column is words."""
    first, *others = zip(cells, WIDTHS, strict=True)
    return "  ".join([f"{first[0]:{first[1]}}", *(f"{text:>{width}}" for text, width in others)])
