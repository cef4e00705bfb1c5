"""Trainings small enough for tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from baselines import Learned, Policy, train_players, write_learned
from ppg_env import Game, make_game
from ppg_env.env.observation import observation_size


@pytest.fixture(scope="session")
def game() -> Game:
    return make_game("intersection", speed="l1")


@pytest.fixture(scope="session")
def learned(game: Game) -> Learned:
    """Two runs of a training that is much too short."""
    return train_players(game, seeds=[0, 1], steps=8192)


@pytest.fixture(scope="session")
def learned_file(learned: Learned, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_learned(tmp_path_factory.mktemp("learned") / "short.npz", learned)


def small_policy(game: Game, seed: int = 0, **options: bool) -> Policy:
    """A random network of the right size."""
    import numpy as np

    random = np.random.default_rng(seed)
    width = observation_size(game.agents[0].state_dim, game.dim, len(game.agents))
    sizes = [width + options.get("conditioned", False), 8, game.agents[0].control_dim]
    pairs = list(zip(sizes[1:], sizes[:-1], strict=True))
    return Policy(
        tuple(random.normal(size=pair) for pair in pairs),
        tuple(random.normal(size=pair[0]) for pair in pairs),
        **options,
    )
