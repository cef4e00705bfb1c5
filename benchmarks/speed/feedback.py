"""Feedback policies of two agents: times to find them, their costs, and proved bounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import perf_counter

from baselines.pretrained import find_pretrained
from benchmarks.speed.measurement import Measurement
from ppg_env.env.episodes import evaluate
from ppg_env.env.players import GoToGoal, Player
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game
from solvers.feedback.bounds.lower_bound import social_lower_bound, solo_lower_bound
from solvers.feedback.grid.dynamic_programming import (
    best_feedback_response,
    feedback_equilibrium,
    feedback_optimum,
)
from solvers.feedback.grid.feedback_solution import FeedbackSolution

STEP, COARSE = 2.5, 15.0
"""Distance of grid positions, and that of a quick run."""

EPISODES, FEW = 100_000, 4096
"""Episodes that give the costs, and those of a quick run."""

GIGABYTE = 1e9


def measurements(*, quick: bool = False, seed: int = 0) -> Iterator[Measurement]:
    """Measure best responses, the optimum and the equilibrium of a scenario in the plane."""
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
    step, episodes = (COARSE, FEW) if quick else (STEP, EPISODES)
    straight: list[Player] = [GoToGoal(game, i) for i in range(2)]
    response = best_feedback_response(game, 0, straight, step=step)
    yield Measurement("best response to a straight player: s", response.seconds, 30)
    yield Measurement("best response: GB", response.memory / GIGABYTE, 4)
    yield from _against_learned(game, step, episodes, seed)
    optimum = feedback_optimum(game, step=step)
    yield Measurement("feedback optimum: s", optimum.seconds, 60)
    yield from _optimum(game, optimum, episodes, seed)
    equilibrium = feedback_equilibrium(game, step=step)
    yield Measurement("feedback equilibrium: s", equilibrium.seconds, 300)
    yield _rate(game, optimum.players(), seed)
    if not quick:
        yield from _bounds(game)


def _against_learned(game: Game, step: float, episodes: int, seed: int) -> Iterator[Measurement]:
    """Measure the best response to a learned player, and what it gains."""
    learned = find_pretrained("ppo-selfish", game).players(game)
    response = best_feedback_response(game, 0, learned, step=step)
    yield Measurement("best response to a learned player: s", response.seconds, 90)
    before, after = (
        evaluate(game, players, episodes, seed).cost[:, 0].mean()
        for players in (learned, response.players())
    )
    yield Measurement("best response to a learned player: gain", float(before - after), 0.30, True)


def _optimum(
    game: Game, optimum: FeedbackSolution, episodes: int, seed: int
) -> Iterator[Measurement]:
    """Measure the simulated cost of the optimum, and how far its grid value is off."""
    cost = float(evaluate(game, optimum.players(), episodes, seed).cost.mean())
    yield Measurement("feedback optimum: mean cost of head_on, l1, lam 0.8", cost, 8.25)
    value = sum(optimum.value) / len(game.agents)
    yield Measurement("feedback optimum: cost / grid value", cost / value, 0, True)


def _rate(game: Game, players: Sequence[Player], seed: int) -> Measurement:
    """Measure decisions per second in the environment, the time of the simulator included."""
    evaluate(game, players, 16, seed)  # compiles
    began = perf_counter()
    episodes = evaluate(game, players, FEW, seed)
    decisions = float(episodes.arrival.sum())
    rate = decisions / (perf_counter() - began)
    return Measurement("decisions per second of those that arrive", rate, 2e4, True)


def _bounds(game: Game) -> Iterator[Measurement]:
    """Measure the proved lower bounds and their times."""
    began = perf_counter()
    alone = solo_lower_bound(game, 0)
    yield Measurement("proved bound, one agent alone: s", perf_counter() - began, 0, True)
    yield Measurement("proved bound, one agent alone: cost", alone, 0, True)
    began = perf_counter()
    both = social_lower_bound(game) / len(game.agents)
    yield Measurement("proved bound, both: s", perf_counter() - began, 0, True)
    yield Measurement("proved bound, both: mean cost", both, 0, True)
