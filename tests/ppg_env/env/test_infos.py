"""Infos: the same keys, shapes and types at every step, and events that stay true."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from ppg_env import InputError, PathPlanningEnv, SingleAgentEnv, make_game, parallel_env
from tests.ppg_env.env.test_official import in_motion


def form(info: dict[str, Any]) -> dict[str, tuple[Any, ...]]:
    """What a client has to know to put infos into tensors."""
    arrays = {key: np.asarray(value) for key, value in info.items()}
    return {key: (array.dtype, array.shape, type(info[key])) for key, array in arrays.items()}


def play(env: PathPlanningEnv, seed: int, wish: float = 1.0) -> list[dict[str, dict[str, Any]]]:
    """All infos of an episode in which agents head for their goals, more or less."""
    random = np.random.default_rng(seed)
    trail = [env.reset(seed=seed)[1]]
    while env.agents:
        actions = {}
        for agent in env.agents:
            i, size = env.possible_agents.index(agent), env.action_space(agent).shape[0]
            away = env.simulator.tables.goal[i, :size] - env.simulator.state[0, i, :size]
            actions[agent] = wish * away + random.normal(0, 3, size)
        trail.append(env.step(actions)[4])
    return trail


@pytest.mark.parametrize("rules", [{}, {"on_crash": "continue", "reward": "margin"},
                                   {"sharing": "social"}], ids=str)  # fmt: skip
def test_infos_have_one_form_in_every_scenario(scenario: str, rules: dict[str, Any]) -> None:
    env = parallel_env(scenario, **rules)
    trail = [infos for seed in range(3) for infos in play(env, seed)]
    forms = [form(info) for infos in trail for info in infos.values()]
    assert all(each == forms[0] for each in forms)
    assert all(dtype.kind in "bf" for dtype, _, _ in forms[0].values())
    bodies = len(env.game.agents) + len(env.game.obstacles)
    assert forms[0]["crashed_with"] == (np.dtype(bool), (bodies,), np.ndarray)


@pytest.mark.parametrize("rules", [{"on_crash": "continue"}, {"sharing": "social"},
                                   {"on_goal": "stay"}], ids=str)  # fmt: skip
def test_arrived_and_crashed_stay_true_from_the_step_of_the_event(rules: dict[str, Any]) -> None:
    env = parallel_env("intersection3", speed="l1", noise=0.5, **rules)
    counts = {"arrived": 0, "crashed": 0}
    for seed in range(20):
        trail = play(env, seed)
        for agent in env.possible_agents:
            own = [infos[agent] for infos in trail if agent in infos]
            for key in counts:
                flags = [info[key] for info in own]
                assert flags == sorted(flags), "once true, always true"
                counts[key] += flags[-1]
            met = [bool(info["crashed_with"].any()) for info in own]
            assert [info["crashed"] for info in own] == np.logical_or.accumulate(met).tolist()
    assert min(counts.values()) > 0


def test_crashes_name_agents_and_obstacles() -> None:
    game, both = make_game("corridor(20)", noise=0.0), {}
    for kind in ("numbers", "names"):
        env = parallel_env(game, infos=kind, on_crash="continue")
        env.reset(seed=0)
        for _ in range(3):  # agent_0 drives into the upper wall, of obstacle_1
            both[kind] = env.step({"agent_0": [10.0, 10.0], "agent_1": [-10.0, 0.0]})[4]
    flags = [both["numbers"][agent]["crashed_with"].tolist() for agent in ("agent_0", "agent_1")]
    assert flags == [[False, False, False, True], [False] * 4]
    assert both["names"]["agent_0"]["crashed_with"] == ["obstacle_1"]
    assert both["names"]["agent_1"]["crashed_with"] == []
    with pytest.raises(InputError, match="numbers or names"):
        parallel_env(game, infos="all")


def test_costs_add_up_and_effort_is_a_part() -> None:
    env = parallel_env("head_on", noise=0.0, effort=0.25, lam=0.4)
    env.reset(seed=0)
    _, rewards, _, _, infos = env.step({"agent_0": [3.0, -2.0], "agent_1": [0.0, 0.0]})
    own = infos["agent_0"]
    assert own["effort_cost"] == pytest.approx(0.25 * 5.0, abs=1e-12)
    assert own["time_cost"] == pytest.approx(0.4 + 0.25 * 5.0)
    assert infos["agent_1"]["effort_cost"] == 0.0
    for agent, info in infos.items():
        assert rewards[agent] == -(info["time_cost"] + info["safety_cost"])


def test_vector_environments_stack_infos() -> None:
    game = in_motion()
    env = SyncVectorEnv(
        [partial(SingleAgentEnv, game, max_cycles=5) for _ in range(3)],
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    _, first = env.reset(seed=0)
    for _ in range(12):
        infos = env.step(np.tile([10.0, 0.0], (3, 1)).astype(np.float32))[4]
        for key in ("arrived", "crashed", "time_cost", "effort_cost", "safety_cost"):
            assert infos[key].shape == (3,)
            assert infos[key].dtype == first[key].dtype
        assert infos["crashed_with"].shape == first["crashed_with"].shape == (3, 4)
    env.close()
