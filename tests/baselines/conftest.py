"""Trainings small enough for tests."""

from __future__ import annotations

import pytest

from baselines import Learned, train_players
from ppg_env import Game, make_game
from tests.baselines.small import ROLLOUT, shorten_trainings


@pytest.fixture(scope="session")
def game() -> Game:
    return make_game("intersection", speed="l1")


@pytest.fixture(scope="session")
def learned(game: Game) -> Learned:
    """Two runs of a training that is much too short."""
    with pytest.MonkeyPatch.context() as patch:
        shorten_trainings(patch)
        return train_players(game, seeds=[0, 1], steps=ROLLOUT)
