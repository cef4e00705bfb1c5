"""The paper's scenarios, each solved once and then judged by the tests of several modules."""

from __future__ import annotations

from itertools import product

import pytest

from ppg_env import Game, make_game
from solvers import Solution, best_response_dynamics, potential_equilibrium, social_optimum
from tests.marks import slow_if

PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")

Case = tuple[str, str, str, float, float]
"""Scenario, speed set, objective, lam, gain."""


def cases() -> list[Case]:
    """Most for the box; for the L1 ball, where plans are longer, a choice."""
    pairs = [(0.5, 0.0), (0.5, 0.5), (0.8, 0.5)]
    head = product(PAPER, ["box"], ["margin", "risk"])
    box = [(*case, lam, gain) for case in head for lam, gain in pairs]
    margin = list(product(PAPER, ["l1"], ["margin"], [0.5, 0.8], [0.5]))
    risk = list(product(PAPER[:4], ["l1"], ["risk"], [0.5], [0.5]))
    return box + margin + risk


def repeats(case: Case) -> bool:
    """Whether the same scenario with a smaller lam, or with gain, guards a change."""
    return case[3] > 0.5 or (case[4] == 0.0 and case[0] != "head_on")


def name_of(case: Case) -> str:
    name, speed, objective, lam, gain = case
    return f"{name} {speed} {objective} lam={lam} gain={gain}"


# Session scope lets pytest keep the tests of one case together, so each is solved once.
@pytest.fixture(scope="session", params=slow_if(repeats, cases()), ids=name_of)
def paper_game(request: pytest.FixtureRequest) -> Game:
    name, speed, objective, lam, gain = request.param
    return make_game(name, speed=speed, objective=objective, lam=lam, gain=gain)


@pytest.fixture(scope="session")
def social(paper_game: Game) -> Solution:
    return social_optimum(paper_game)


@pytest.fixture(scope="session")
def potential(paper_game: Game) -> Solution:
    return potential_equilibrium(paper_game)


@pytest.fixture(scope="session")
def nash(paper_game: Game) -> Solution:
    return best_response_dynamics(paper_game)
