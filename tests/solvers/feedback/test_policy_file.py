from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppg_env.env.episodes import evaluate
from ppg_env.errors import InputError
from solvers import (
    best_feedback_response,
    feedback_equilibrium,
    feedback_optimum,
    read_feedback,
    write_feedback,
)
from tests.solvers.feedback.line_games import line_agent, line_game


def small(horizon: int = 6):
    return line_game(line_agent(0.0, 30.0), line_agent(25.0, 55.0, -6.0, 6.0), horizon=horizon)


@pytest.mark.parametrize("solve", [feedback_optimum, feedback_equilibrium])
def test_a_file_plays_as_the_solution_does(tmp_path: Path, solve):
    solution = solve(small())
    copy = read_feedback(write_feedback(tmp_path / "policy.npz", solution))
    assert copy.value == solution.value
    costs = [evaluate(s.game, s.players(), 256, seed=4).cost for s in (solution, copy)]
    assert np.array_equal(costs[0], costs[1])


def test_a_stationary_solution_may_be_saved_as_one_stage(tmp_path: Path):
    solution = feedback_optimum(small(horizon=10))
    assert solution.stationary
    copy = read_feedback(write_feedback(tmp_path / "policy.npz", solution, last=True))
    assert copy.stages == 1
    costs = [evaluate(s.game, s.players(), 256, seed=4).cost for s in (solution, copy)]
    assert costs[0] == pytest.approx(costs[1])


def test_what_is_no_solution_is_refused(tmp_path: Path):
    solution = feedback_optimum(small())
    response = best_feedback_response(small(), 0, solution.players())
    with pytest.raises(InputError, match="is a response"):
        write_feedback(tmp_path / "response.npz", response)
    with pytest.raises(InputError, match="does not exist"):
        read_feedback(tmp_path / "nothing.npz")
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(InputError, match="cannot be read"):
        read_feedback(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", about=np.array('{"format": "other"}'))
    with pytest.raises(InputError, match="is not a file of feedback policies"):
        read_feedback(tmp_path / "other.npz")


def test_players_share_a_decision_without_a_change_of_it():
    solution = feedback_equilibrium(small())
    apart = replace(solution, policy=replace(solution.policy, latest=[]))
    mixed = [solution.players()[0], apart.players()[1]]
    costs = [
        evaluate(small(), players, 256, seed=7).cost for players in (solution.players(), mixed)
    ]
    assert np.array_equal(costs[0], costs[1])
