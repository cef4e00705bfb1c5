"""Seeds are read alike by all views, and wrong ones are refused in one sentence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ppg_env import (
    GameVectorEnv,
    InputError,
    Simulator,
    SingleAgentEnv,
    make_game,
    parallel_env,
    path_planning_v0,
)

VIEWS: dict[str, Callable[[Any], Any]] = {
    "parallel": lambda seed: parallel_env("head_on", sigma0=2.0).reset(seed=seed)[0]["agent_0"],
    "single": lambda seed: SingleAgentEnv("head_on", sigma0=2.0).reset(seed=seed)[0],
    "vector": lambda seed: GameVectorEnv("head_on", 2, sigma0=2.0).reset(seed=seed)[0],
    "batch": lambda seed: Simulator(make_game("head_on", sigma0=2.0), copies=2, seed=seed).reset(),
}


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("seed", [-1, 1.5, "a", True, 2 + 0j, {}], ids=str)
def test_what_is_no_seed_is_refused(view: str, seed: Any) -> None:
    with pytest.raises(InputError, match=r"^seed: is .*; give a whole number that is not negative"):
        VIEWS[view](seed)


@pytest.mark.parametrize("view", VIEWS)
def test_whole_numbers_of_any_type_are_the_same_seed(view: str) -> None:
    start = VIEWS[view](3)
    for seed in (np.int64(3), np.uint8(3)):
        assert np.array_equal(VIEWS[view](seed), start)
    assert not np.array_equal(VIEWS[view](2**70), start)


def test_several_numbers_seed_views_of_several_copies() -> None:
    for view in ("vector", "batch"):
        start = VIEWS[view]([3, 4])
        assert np.array_equal(VIEWS[view](np.array([3, 4])), start)
        for bad in ([], [3, -4], [3, None], [[3]], [1.5]):
            with pytest.raises(InputError, match=r"^seed: is "):
                VIEWS[view](bad)
    for view in ("parallel", "single"):
        with pytest.raises(InputError, match=r"^seed: is "):
            VIEWS[view]([3, 4])


def test_the_turn_based_view_refuses_seeds_alike() -> None:
    with pytest.raises(InputError, match=r"^seed: is -1;"):
        path_planning_v0.env("head_on").reset(seed=-1)
