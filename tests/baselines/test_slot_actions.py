"""Actions of slots that do not fit are refused by name; those of finished learners are ignored."""

from __future__ import annotations

import numpy as np
import pytest

from baselines import GameVecEnv
from ppg_env import InputError, make_game


def test_slots_refuse_shapes_and_values_by_name() -> None:
    env = GameVecEnv(make_game("head_on"), copies=2)
    with pytest.raises(InputError, match=r"^step: comes before the first reset; call reset first"):
        env.step(np.zeros((4, 2)))
    env.reset()
    for shape in ((4,), (2, 2), (4, 3), (2, 2, 2)):
        with pytest.raises(InputError, match=r"^actions: .*give numbers of shape \(4, 2\)"):
            env.step(np.zeros(shape))
    bad = np.zeros((4, 2))
    bad[3, 1] = np.nan
    with pytest.raises(InputError, match=r"^action\[1, 1\]: .*agent_1 in copy 1"):
        env.step(bad)


def test_a_learner_that_has_finished_may_send_anything() -> None:
    env = GameVecEnv(make_game("parallel", speed="l1", noise=0.0), copies=1)
    env.reset()
    action = np.array([[1.0, 0.0], [0.0, 0.0]])
    for _ in range(12):
        env.step(action)
        if env.simulator.status[0, 0]:
            action[0] = np.nan
    assert np.isnan(action[0]).all()
    assert np.isfinite(env.simulator.state).all()
