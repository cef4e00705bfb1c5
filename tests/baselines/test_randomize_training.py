"""Training over drawn games: what the network observes, and how its players play elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from baselines import GameVecEnv, LearnedPlayer, read_learned, train_players, write_learned
from ppg_env import Simulator, make_game
from ppg_env.env import Choice, Near, Randomize, Uniform
from ppg_env.env.observation import observation_size
from ppg_env.errors import InputError
from ppg_env.game.game import Game
from tests.baselines.small import ROLLOUT, shorten_trainings, small_policy

RULE = Randomize(
    lam=Uniform(0.2, 0.8), noise=Uniform(1.0, 3.0), goal=Near(2.0), size=Choice([1.0, 1.1])
)
FIELDS = {"drawn": ("lam", "noise", "size", "goal"), "shared": ()}


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    shorten_trainings(monkeypatch)


def own_inputs(game: Game, agent: int) -> np.ndarray:
    """Return what a policy of all fields sees at the start of ``game``, played without a rule."""
    simulator = Simulator(game, seed=0)
    simulator.reset()
    policy = small_policy(game, extra=10, **FIELDS)
    return LearnedPlayer(game, agent, policy)._seen(simulator.view(agent).observation)


@pytest.mark.parametrize("agent", [0, 1])
def test_in_a_fixed_game_a_player_observes_the_values_of_the_game(game: Game, agent: int) -> None:
    still = {field: Near(0.0) for field in FIELDS["drawn"]}
    drawing = Simulator(game, seed=0, randomize=Randomize(**still))
    drawing.reset()
    assert drawing.observation_size == observation_size(game) + 10
    np.testing.assert_array_equal(own_inputs(game, agent), drawing.last.observation[:, agent])


def test_players_of_another_rule_are_refused_in_one_sentence(game: Game) -> None:
    simulator = Simulator(game, randomize=Randomize(lam=Near(0.1)))
    simulator.reset()
    player = LearnedPlayer(game, 0, small_policy(game, extra=10, **FIELDS))
    with pytest.raises(InputError, match="observes 19 entries, and the environment has 11"):
        player.act(simulator.view(0))


@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("method", ["shared", "independent", "off-policy"])
def test_a_training_over_drawn_games_is_written_and_played(
    game: Game, method: str, tmp_path
) -> None:
    learned = train_players(game, method, randomize=RULE, steps=ROLLOUT)
    assert learned.about["lam"] is None
    (row,) = learned.about["figures"]
    assert row["lam"] == []
    again = read_learned(write_learned(tmp_path / "a.npz", learned))
    assert again.runs == learned.runs
    policy = again.runs[0][0]
    assert policy is not None
    assert policy.inputs == GameVecEnv(game, randomize=RULE, copies=1).observation_space.shape[0]
    assert again.about["randomize"]["lam"] == {"uniform": [0.2, 0.8]}


@pytest.mark.usefixtures("_short")
def test_players_fit_games_between_the_extremes(game: Game) -> None:
    rule = Randomize(lam=Uniform(0.2, 0.8), noise=Choice([1.0, 3.0]), shared=("lam",))
    learned = train_players(game, randomize=rule, steps=ROLLOUT)

    def fits(**overrides: float) -> bool:
        return learned.fits(make_game("intersection", speed="l1", **overrides))

    assert fits()
    assert fits(lam=0.8, noise=2.0)
    assert not fits(lam=0.81)
    assert not fits(noise=3.1)
    assert not fits(lam=0.5, noise=0.9)
    assert not learned.fits(make_game("head_on", speed="l1"))


def test_a_rule_that_does_not_fit_is_refused_before_training(game: Game) -> None:
    with pytest.raises(InputError, match="agents: may be 3, and the game has 2"):
        train_players(game, randomize=Randomize(agents=Choice([3])))
    with pytest.raises(InputError, match="no feedback players to imitate"):
        train_players(game, randomize=RULE, warm_start="feedback")
