"""Regret of players: found where there is something to gain, never negative, never above cost."""

from __future__ import annotations

import pytest

from baselines import Learned, regret_bounds
from baselines.deviations import DeviationOptions, usual_deviations
from baselines.regret import EVALUATION
from ppg_env import Game, InputError, make_game
from ppg_env.env.episodes import evaluate, mean_interval
from ppg_env.env.players import GoToGoal, straight_players, track
from ppg_env.scenarios.make import override_game
from solvers import best_feedback_response, best_response_dynamics, feedback_optimum
from tests.baselines.small import ROLLOUT
from tests.solvers.feedback.line_games import line_agent, line_game

PLANNED = {"deviations": ["planned"], "episodes": 2000}


@pytest.mark.slow
def test_who_could_dodge_and_does_not_has_regret() -> None:
    """Straight lines crash for sure; either agent alone could save itself nearly all of it."""
    game = make_game("head_on", speed="l1", objective="risk")
    found = regret_bounds(game, straight_players(game), **PLANNED)
    assert sorted(found) == [0, 1]
    for bound in found.values():
        assert bound.deviation == "planned"
        assert bound.regret.low > 40  # of a crash that costs 50
        assert bound.regret.value == bound.gains["planned"].value
        assert bound.regret.high < bound.most < bound.cost.high


def test_who_has_nothing_to_gain_has_none() -> None:
    game = make_game("parallel", speed="l1")
    found = regret_bounds(game, straight_players(game), agents=[1], **PLANNED)
    for bound in found.values():
        assert 0 <= bound.regret.low <= bound.regret.value <= bound.regret.high < 0.1


def test_a_grid_is_used_where_it_applies() -> None:
    assert usual_deviations(make_game("head_on")) == ("grid", "planned")
    assert usual_deviations(make_game("intersection3")) == ("planned", "trained")
    three = make_game("intersection3")
    blind = [GoToGoal(three, i) for i in range(3)]
    with pytest.raises(InputError, match="follows no plan"):
        regret_bounds(three, blind, deviations=["grid"], episodes=100)


def test_the_gain_on_a_grid_is_that_of_the_best_response() -> None:
    """A fast agent behind a slow one, both blind: the first gains by waiting."""
    game = line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0))
    players = straight_players(game)
    words = {"deviations": ["grid"], "agents": [0], "episodes": 1024}
    found = regret_bounds(game, players, **words, options=DeviationOptions(time_limit=None))[0]
    response = best_feedback_response(game, 0, players)
    costs = [
        evaluate(game, team, 1024, group=EVALUATION).cost[:, 0]
        for team in (players, response.players())
    ]
    assert found.gains["grid"] == mean_interval(costs[0] - costs[1])
    assert found.deviation == "grid"
    assert found.regret.low > 0
    with pytest.raises(InputError, match="memory_limit"):
        regret_bounds(game, players, **words, options=DeviationOptions(memory_limit=1e3))


def test_responses_to_policies_from_grids_have_finer_grids() -> None:
    game = line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0), horizon=2)
    optimum = feedback_optimum(game)
    assert best_feedback_response(game, 0, optimum.players()).step < optimum.step


@pytest.mark.nightly
@pytest.mark.slow
def test_the_response_on_a_grid_gains_more_than_a_plan() -> None:
    """It sees the other agent, and a plan does not."""
    game = make_game("intersection", speed="l1", objective="risk", lam=0.8)
    nash = best_response_dynamics(game)
    assert nash.profile is not None
    found = regret_bounds(game, track(game, nash.profile), episodes=4000)
    for bound in found.values():
        assert bound.deviation == "grid"
        assert bound.gains["grid"].low > bound.gains["planned"].high


@pytest.mark.slow
def test_a_trained_deviation_is_found_and_repeats() -> None:
    game = make_game("head_on", speed="l1")
    words = {
        "agents": [1],
        "deviations": ["trained"],
        "episodes": 2000,
        "seed": 2,
        "options": DeviationOptions(steps=150_000, seed=2),
    }
    found = regret_bounds(game, straight_players(game), **words)
    assert list(found) == [1]
    assert found[1].gains["trained"].low > 40
    assert found == regret_bounds(game, straight_players(game), **words)


@pytest.mark.slow
@pytest.mark.usefixtures("short_trainings")
def test_learned_and_planned_players_have_bounds_that_are_never_negative(
    game: Game, learned: Learned
) -> None:
    nash = best_response_dynamics(override_game(game, objective="risk"))
    options = DeviationOptions(steps=ROLLOUT)
    for players in (learned.players(game), track(game, nash.profile)):
        found = regret_bounds(
            game,
            players,
            agents=[0],
            deviations=["trained", "planned"],
            episodes=500,
            options=options,
        )
        for bound in found.values():
            assert set(bound.gains) == {"trained", "planned"}
            assert 0 <= bound.regret.low <= bound.regret.value <= bound.regret.high
            if bound.deviation == "none":
                assert bound.regret.high == 0
            else:
                assert bound.regret.value == max(bound.gains[bound.deviation].value, 0)


def test_wrong_choices_are_refused(game: Game) -> None:
    with pytest.raises(InputError, match="steps"):
        DeviationOptions(steps=0)
    with pytest.raises(InputError, match="grid or planned or trained"):
        regret_bounds(game, straight_players(game), deviations=["magic"], episodes=100)
