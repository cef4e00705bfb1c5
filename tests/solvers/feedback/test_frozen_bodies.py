"""Bodies that an agent does not observe: obstacles that drift, and players that track plans."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env.env.episodes import evaluate
from ppg_env.env.players import GoToGoal, straight_players
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.dynamics import covariances
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from solvers import best_feedback_response, feedback_optimum
from solvers.feedback.grid.frozen_bodies import frozen_bodies
from tests.solvers.feedback.line_games import KAPPA, LAM, NOISE, line_agent, line_game, overlap

ONE_STEP = Rules(max_cycles=1)


def test_a_drift_adds_to_the_noise():
    drifting = Obstacle(Polytope.box([15.0]), path=[[27.5], [26.5]], noise=6.0)
    game = Game(
        (line_agent(0.0, 200.0, 9.5, 10.0),), (drifting,), objective="risk", crash_cost=KAPPA,
        horizon=10,
    )  # fmt: skip
    value = feedback_optimum(game, ONE_STEP, step=1.25).value[0]
    assert value == pytest.approx(LAM + (1 - LAM) * KAPPA * overlap(17.0, NOISE + 6.0), rel=0.02)


@pytest.mark.parametrize("gain", [0.0, 0.5])
def test_the_steps_of_a_tracked_plan_have_its_covariances(gain):
    agents = [line_agent(0.0, 40.0), line_agent(60.0, 0.0)]
    object.__setattr__(agents[1], "gain", np.array([[gain]]))
    game = line_game(*agents)
    [body] = frozen_bodies(game, 0, {1: straight_players(game)[1].plan})
    exact = covariances(agents[1], game.horizon)
    for t in range(5):
        hazard = body.hazard(t, swept=True)
        assert hazard.end == pytest.approx(exact[t + 1])
        if t:
            assert hazard.carry == pytest.approx(1 - gain)
            assert hazard.noise == pytest.approx(NOISE)
    assert body.hazard(6, swept=False) is None  # it has arrived


@pytest.mark.parametrize("collisions", ["instants", "swept"])
def test_a_response_to_tracked_plans_gains_and_costs_what_its_value_says(collisions):
    """A fast agent behind a slow one; a third, far away, makes the joint state too large."""
    pair = line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0)
    game = line_game(*pair, line_agent(500.0, 540.0), collisions=collisions)
    players = straight_players(game)
    response = best_feedback_response(game, 0, players)
    assert response.agents == (0,)
    before, after = (
        evaluate(game, team, 4096, seed=5).cost[:, 0].mean()
        for team in (players, response.players())
    )
    assert after < 0.9 * before
    assert response.value[0] == pytest.approx(after, rel=0.1)


def test_players_that_follow_no_plan_are_refused():
    game = line_game(*(line_agent(60.0 * i, 60.0 * i + 40.0) for i in range(3)))
    with pytest.raises(InputError, match=r"players\[1\].*follows no plan"):
        best_feedback_response(game, 0, [GoToGoal(game, i) for i in range(3)])
