"""Trainings and networks small enough for tests."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from baselines import Policy
from ppg_env import Game
from ppg_env.env.observation import observation_size

ROLLOUT = 1024
"""Environment steps of a shortened rollout of PPO in a game of two agents."""


def shorten_trainings(patch: pytest.MonkeyPatch) -> None:
    """Shorten every phase of every method: all code runs, and nothing is learned.

    Worker processes import the modules again and train at full length.
    """
    from baselines import cost_descent, imitation, ppo, sac_single, train, warm_start
    from baselines.figures import figures

    patch.setattr(warm_start, "UPDATES", 10)
    patch.setattr(warm_start, "CRITIC_ROLLOUTS", 1)
    patch.setattr(cost_descent, "UPDATES", 10)
    patch.setattr(imitation, "COPIES", 8)
    patch.setattr(imitation, "ROUNDS", 2)
    patch.setattr(imitation, "UPDATES", 10)
    patch.setattr(imitation, "LAST_UPDATES", 10)
    patch.setattr(ppo, "ROLLOUT", 2)
    patch.setattr(ppo, "EPOCHS", 1)
    patch.setattr(sac_single, "ROLLOUT", 10)
    patch.setattr(sac_single, "UPDATES", 1)
    patch.setattr(sac_single, "BATCH", 64)
    patch.setattr(sac_single, "BUFFER", 1000)  # fewer than the steps taken: it wraps around
    patch.setattr(train, "figures", partial(figures, episodes=500))


def small_policy(game: Game, seed: int = 0, extra: int = 0, **options: Any) -> Policy:
    """A random network of the right size, with ``extra`` inputs about what is drawn."""
    random = np.random.default_rng(seed)
    sizes = [
        observation_size(game) + extra + options.get("conditioned", False),
        8,
        game.agents[0].control_dim,
    ]
    pairs = list(zip(sizes[1:], sizes[:-1], strict=True))
    return Policy(
        tuple(random.normal(size=pair) for pair in pairs),
        tuple(random.normal(size=pair[0]) for pair in pairs),
        **options,
    )
