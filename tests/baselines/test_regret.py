"""Lower bounds on regret: found where there is something to gain, never negative."""

from __future__ import annotations

import pytest

from baselines import Learned, regret_bounds
from ppg_env import Game, InputError, make_game
from ppg_env.env.players import straight_players, track
from ppg_env.scenarios.make import override_game
from solvers import best_response_dynamics
from tests.baselines.small import ROLLOUT


def test_who_could_dodge_and_does_not_has_regret() -> None:
    """Straight lines crash for sure; either agent alone could save itself nearly all of it."""
    game = make_game("head_on", speed="l1", objective="risk")
    found = regret_bounds(game, straight_players(game), steps=0, episodes=2000)
    assert sorted(found) == [0, 1]
    for bound in found.values():
        assert bound.deviation == "planned"
        assert bound.regret.low > 40  # of a crash that costs 50
        assert bound.regret.value == bound.gains["planned"].value


def test_who_has_nothing_to_gain_has_none() -> None:
    game = make_game("parallel", speed="l1")
    found = regret_bounds(game, straight_players(game), steps=0, episodes=2000)
    for bound in found.values():
        assert 0 <= bound.regret.low <= bound.regret.value <= bound.regret.high < 0.1


@pytest.mark.slow
def test_a_trained_deviation_is_found_and_repeats() -> None:
    game = make_game("head_on", speed="l1")
    words = {"agents": [1], "steps": 150_000, "episodes": 2000, "seed": 2}
    found = regret_bounds(game, straight_players(game), **words)
    assert list(found) == [1]
    assert found[1].gains["trained"].low > 40
    assert found == regret_bounds(game, straight_players(game), **words)


@pytest.mark.usefixtures("short_trainings")
def test_learned_and_planned_players_have_bounds_that_are_never_negative(
    game: Game, learned: Learned
) -> None:
    nash = best_response_dynamics(override_game(game, objective="risk"))
    for players in (learned.players(game), track(game, nash.profile)):
        found = regret_bounds(game, players, steps=ROLLOUT, episodes=500)
        for bound in found.values():
            assert set(bound.gains) == {"trained", "planned"}
            assert 0 <= bound.regret.low <= bound.regret.value <= bound.regret.high
            if bound.deviation == "none":
                assert bound.regret.high == 0
            else:
                assert bound.regret.value == max(bound.gains[bound.deviation].value, 0)


def test_fewer_than_no_steps_are_refused(game: Game) -> None:
    with pytest.raises(InputError, match="steps"):
        regret_bounds(game, straight_players(game), steps=-1)
