"""The drill ``faults``: wrong answers of the back ends, over random games.

Plans that are returned are judged by the library's checker, which shares no code with the planners.
Answers with too small a value, or none, must never make a bound wrong; a value too large or a false
``infeasible`` cannot be seen as such, but must never make a plan wrong.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import inf, nan
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.library import checker
from ppg_env import Game
from ppg_env.formats.game_file import game_to_tables
from ppg_env.game import objective
from ppg_env.game.plan import Profile
from solvers import best_response_dynamics, certify, social_optimum
from solvers.budget import Budget
from solvers.engine.arrival_search import engine_search
from solvers.engine.node_lp import Relaxation
from solvers.reference import cvxpy_backend as backend
from solvers.solution import Status
from tests.drills.figures import Figure
from tests.oracles.random_games import random_game

GAMES, NODES = 60, 200
"""Random games in a night; linear programs of a search with faults."""

Answer = tuple[float, np.ndarray] | None


@dataclass(frozen=True)
class Fault:
    """A wrong answer; ``sound`` if its value is still a lower bound."""

    change: Callable[[float, np.ndarray, np.random.Generator], Answer]
    sound: bool = True


LINEAR = {
    "time-out": Fault(lambda value, point, random: None),
    "all zeros": Fault(lambda value, point, random: (0.0, np.zeros_like(point))),
    "perturbed point": Fault(
        lambda value, point, random: (value, point + 1e-3 * random.normal(size=len(point)))
    ),
    "value too small": Fault(lambda value, point, random: (value - 0.3, point)),
    "value too large": Fault(lambda value, point, random: (value + 0.3, point), sound=False),
    "false infeasible": Fault(lambda value, point, random: (inf, np.zeros(0)), sound=False),
}
MIXED = {
    "time-out": (lambda answer: backend.Answer("none", -inf, "time limit"), True),
    "wrong status": (lambda answer: backend.Answer("error", nan, "unknown"), True),
    "false infeasible": (lambda answer: backend.Answer("infeasible", inf, "infeasible"), False),
    "bound too large": (lambda answer: replace(answer, bound=answer.bound + 0.3), False),
    "undefined bound": (lambda answer: replace(answer, bound=nan), True),
}


def drill(size: float) -> Iterator[Figure]:
    """Inject every fault into the searches of random games."""
    count = max(round(GAMES * size), 3)
    games = [random_game(seed)[0] for seed in range(count)]
    truths = [
        engine_search(objective.social(game), _all(game), None, Budget(None)) for game in games
    ]
    solved = [(g, t) for g, t in zip(games, truths, strict=True) if t.status is Status.OPTIMAL]
    for name, fault in LINEAR.items():
        ends, failures = Counter[str](), list[str]()
        for k, (game, truth) in enumerate(solved):
            for share in (0.2, 1.0):
                with mock.patch.object(Relaxation, "solve", _faulty(fault, share, k)):
                    result = engine_search(
                        objective.social(game), _all(game), None, Budget(None, NODES)
                    )
                ends[result.status.name.lower()] += 1
                where = f"game {k}, {share:g} of the answers"
                failures += _lies(game, result, truth.value, fault.sound, where)
        yield _figure(f"linear programs: {name}", sum(ends.values()), "searches", ends, failures)
    yield from _certificates(solved)
    yield from _mixed(solved[: max(3, len(solved) // 6)])


def _all(game: Game) -> tuple[int, ...]:
    return tuple(range(len(game.agents)))


def _faulty(fault: Fault, share: float, seed: int) -> Callable[..., Answer]:
    solve, random = Relaxation.solve, np.random.default_rng(seed)

    def changed(self: Relaxation, cutoff: float = inf) -> Answer:
        solution = solve(self, cutoff)
        if solution is None or solution[0] == inf or random.random() >= share:
            return solution
        return fault.change(*solution, random)

    return changed


def _lies(game: Game, result: Any, truth: float, sound: bool, where: str) -> list[str]:
    """Return what is wrong about a result, a search's or a planner's."""
    lies, room = [], 1e-5 * max(1.0, truth)
    if result.profile is not None:
        value = _checked(game, result.profile)
        if value is None:
            lies.append("a plan that the checker refuses")
        elif value < truth - room:
            lies.append("a plan cheaper than the optimum")
    if sound:
        if not result.bound <= truth + room:
            lies.append(f"bound {result.bound:g} above the optimum {truth:g}")
        if result.status is Status.INFEASIBLE:
            lies.append("called infeasible")
        if result.status is Status.OPTIMAL and result.value > truth + room:
            lies.append("called optimal at a gap")
    return [f"{where}: {lie}" for lie in lies]


def _checked(game: Game, profile: Profile) -> float | None:
    plan = {
        "controls": [one.controls.tolist() for one in profile],
        "arrival": [one.arrival for one in profile],
    }
    answer = checker.check(game_to_tables(game), plan)
    return float(answer["social_cost"]) if answer["accepted"] else None


def _certificates(solved: list[Any]) -> Iterator[Figure]:
    """Certify optima with faulty best responses: a regret must not shrink."""
    for name, fault in LINEAR.items():
        if not fault.sound:
            continue
        failures = []
        for k, (game, truth) in enumerate(solved):
            real = certify(game, truth.profile).regret
            with mock.patch.object(Relaxation, "solve", _faulty(fault, 0.5, k)):
                try:
                    regret = certify(game, truth.profile).regret
                except Exception as error:
                    failures.append(f"game {k}: {type(error).__name__} {error}")
                    continue
            if (regret < real - 1e-5).any():
                failures.append(f"game {k}: regret {regret} below {real}")
        yield _figure(f"certificates: {name}", len(solved), "certificates", Counter(), failures)


def _mixed(solved: list[Any]) -> Iterator[Figure]:
    for name, (change, sound) in MIXED.items():
        ends, failures, solve = Counter[str](), list[str](), backend.solve
        for k, (game, truth) in enumerate(solved):
            with mock.patch.object(backend, "solve", _changed(solve, change)):
                results = [
                    social_optimum(game, solver="HIGHS", time_limit=5),
                    best_response_dynamics(game, solver="HIGHS", max_sweeps=2, time_limit=5),
                ]
            ends.update(result.status.name.lower() for result in results)
            failures += _lies(game, results[0], truth.value, sound, f"game {k}, optimum")
            nash = results[1]
            if nash.profile is not None and _checked(game, nash.profile) is None:
                failures.append(f"game {k}, dynamics: a plan that the checker refuses")
        yield _figure(f"mixed-integer programs: {name}", 2 * len(solved), "runs", ends, failures)


def _changed(solve: Callable[..., Any], change: Callable[[Any], Any]) -> Callable[..., Any]:
    return lambda *given: change(solve(*given))


def _figure(what: str, count: int, unit: str, ends: Counter[str], failures: list[str]) -> Figure:
    words = ", ".join(f"{number} {end.replace('_', ' ')}" for end, number in sorted(ends.items()))
    return Figure(what, f"{count} {unit}", words or "no regret below the true one", tuple(failures))
