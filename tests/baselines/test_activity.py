"""What a training reports before its first step."""

from __future__ import annotations

import pytest

from baselines import cost_descent, imitation
from baselines.ppo import make_learner
from baselines.training_loop import Args
from baselines.warm_start import warm_start
from tests.solvers.feedback.line_games import line_agent, line_game


@pytest.mark.usefixtures("short_trainings")
def test_a_warm_start_reports_its_grids_rounds_and_updates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(imitation, "LAMS", 2)
    monkeypatch.setattr(cost_descent, "REPORTED", 5)
    game = line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0))
    args, texts = Args(game, "social", (0.2, 0.8), imitate_feedback=True), []
    warm_start(args, make_learner(args, copies=8), texts.append)
    assert texts == [
        "dynamic programming for lam 0.2, grid 1 of 2",
        "dynamic programming for lam 0.8, grid 2 of 2",
        "imitating feedback players, round 1 of 2",
        "imitating feedback players, round 2 of 2",
        "descending on expected costs, update 0 of 10",
        "descending on expected costs, update 5 of 10",
        "fitting the value network",
        "",
    ]
