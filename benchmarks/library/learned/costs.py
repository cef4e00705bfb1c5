"""Mean costs in test games: of learners that observe the draws, and players made for one game."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.library.learned.drawn_game import DrawnGame
from benchmarks.library.learned.learners import learner
from benchmarks.library.learned.track import Track
from ppg_env.env.episodes import evaluate
from ppg_env.env.players import Player, straight_players
from ppg_env.env.randomize import Randomize
from ppg_env.errors import require
from ppg_env.game.game import Game

SEED = 2024
"""Of the episodes of test games."""


def drawn_players(game: Game, name: str, limit: float | None) -> list[Sequence[Player]]:
    """Return players that plan, or solve, a drawn game; none if they find no plan."""
    if name == "straight":
        return [straight_players(game)]
    from benchmarks.comparison.players import PLAYERS, entrant
    from solvers.planner_options import PlannerOptions

    require(
        name in PLAYERS,
        f"{name!r:.80}",
        "is not a player",
        "write the path of a .py or .npz file, or " + ", ".join(PLAYERS),
    )
    options = PlannerOptions(time_limit=limit)
    return entrant(name, game, options).policies(game, options)


def mean_costs(
    track: Track, test: DrawnGame, name: str, episodes: int, *, limit: float | None = None
) -> list[float]:
    """Return the mean cost of an agent in a test game, for each training of a player.

    All players and trainings meet the same noise.
    """
    runs = learner(track, name)
    if runs is not None:
        rule = test.rule(track.rule("train"))
        return [_mean_cost(track.game, run, test, episodes, rule) for run in runs]
    game = track.drawn(test)
    runs = drawn_players(game, name, limit)
    require(bool(runs), name, "found no plan in a test game", "raise --time-limit")
    return [_mean_cost(game, run, test, episodes, None) for run in runs]


def _mean_cost(
    game: Game, players: Sequence[Player], test: DrawnGame, episodes: int, rule: Randomize | None
) -> float:
    played = evaluate(game, players, episodes, seed=SEED, randomize=rule)
    return float(played.cost.sum(axis=1).mean() / len(test.start))
