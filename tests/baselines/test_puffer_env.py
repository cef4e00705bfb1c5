"""The PufferLib environment against PettingZoo's, and in PufferLib's vector backends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ppg_env import InputError, parallel_env
from ppg_env.env import Choice, GoToGoal, Randomize, Uniform
from tests.baselines.small_games import sizes

pufferlib = pytest.importorskip("pufferlib", reason="needs the extra puffer")
vector = pytest.importorskip("pufferlib.vector")

from baselines import GamePufferEnv  # noqa: E402 - only where PufferLib is installed
from baselines.shaping import straight_pace  # noqa: E402  # likewise

SCENARIOS = ("head_on", "intersection3", "circle(5)", "corridor", "intersection_3d")
ROUGH: dict[str, Any] = {"noise": 30.0, "max_cycles": 15}
"""With so much noise some agents arrive early, some crash and some are late."""


def to_goals(env: GamePufferEnv) -> np.ndarray:
    """Actions (rows, m) that move all agents straight to their goals."""
    simulator = env.simulator
    inputs = np.zeros((*simulator.status.shape, simulator.action_size))
    for i, agent in enumerate(env.game.agents):
        action = GoToGoal(env.game, i).act(simulator.view(i))
        inputs[:, i, : agent.control_dim] = action
    width = np.where(simulator.high > simulator.low, simulator.high - simulator.low, 1.0)
    scaled = 2 * (inputs - simulator.low) / width - 1
    return np.clip(scaled, -1, 1).reshape(env.num_agents, -1).astype(np.float32)


@pytest.mark.parametrize("game", SCENARIOS)
def test_one_copy_is_the_pettingzoo_environment(game: str) -> None:
    single, env = parallel_env(game, **ROUGH), GamePufferEnv(game, reward_scale=50.0, **ROUGH)
    names = single.possible_agents
    observed, wanted = env.reset(seed=2)[0], single.reset(2)[0]
    episodes = 0
    for _ in range(80):
        for i, name in enumerate(names):
            if name in wanted:
                assert np.array_equal(observed[i], wanted[name])
        actions, acting = to_goals(env), single.agents
        given = dict(zip(names, env.simulator.high * actions, strict=True))  # sets are symmetric
        observed, rewards, terminals, truncations, infos = env.step(actions)
        wanted, pay, terminated, truncated, _ = single.step(given)
        over = not single.agents
        for i, name in enumerate(names):
            here = name in acting
            assert rewards[i] == np.float32(pay[name] / 50 if here else 0.0)
            assert truncations[i] == (truncated[name] if here else False)
            assert terminals[i] == (over or (here and terminated[name]))
            assert env.masks[i] == (name in single.agents or over)
        assert bool(infos) == over
        if over:
            episodes, wanted = episodes + 1, single.reset()[0]
    assert episodes >= 5


def test_episodes_are_counted_and_every_row_reports_the_end_of_its_copy() -> None:
    env = GamePufferEnv("intersection3", 40, seed=3, **ROUGH)
    first = env.reset()[0].copy().reshape(40, 3, -1)
    total, length, early, episodes = np.zeros((40, 3)), np.zeros(40), 0, 0
    for _ in range(60):
        alive = env.masks.copy().reshape(40, 3)
        observed, rewards, terminals, truncations, infos = env.step(to_goals(env))
        ended = terminals.reshape(40, 3)
        over = env.simulator.last.over
        assert (terminals >= truncations).all()
        assert not rewards.reshape(40, 3)[~alive].any()
        assert ended[over].all()
        assert (ended[~over] == (alive & ~env.masks.reshape(40, 3))[~over]).all()
        assert np.array_equal(observed.reshape(first.shape)[over], first[over])
        early += int((~alive).sum())
        total, length = total + rewards.reshape(40, 3), length + 1
        if over.any():
            (info,) = infos
            assert info["episode_return"] == pytest.approx(total[over].mean(), rel=1e-5)
            assert info["cost"] == pytest.approx(-info["episode_return"])
            assert info["episode_length"] == pytest.approx(length[over].mean())
            assert 0 <= info["crashed"] <= 1
            assert 0 <= info["arrived"] <= 1
            total[over], length[over], episodes = 0, 0, episodes + int(over.sum())
    assert early > 50
    assert episodes > 100


def test_serial_copies_use_puffer_s_buffers() -> None:
    kwargs: dict[str, Any] = {"game": "head_on", "copies": 3, **ROUGH}
    both = vector.make(GamePufferEnv, env_kwargs=kwargs, backend=vector.Serial, num_envs=2)
    alone = [GamePufferEnv(**kwargs) for _ in range(2)]
    observed, _ = both.reset(seed=4)
    parts = [env.reset(seed=4 + k)[0] for k, env in enumerate(alone)]
    for k in range(30):
        assert np.array_equal(observed, np.concatenate(parts))
        actions = np.concatenate([to_goals(env) for env in alone])
        observed, rewards, *_ = both.step(actions)
        parts = [env.step(actions[6 * i : 6 * i + 6])[0] for i, env in enumerate(alone)]
        assert np.array_equal(rewards, np.concatenate([env.rewards for env in alone])), k
        for env in both.envs:
            assert np.shares_memory(env.observations, both.observations)
    both.close()


def test_processes_step_their_copies() -> None:
    copies = {"game": "intersection3", "copies": 2, **ROUGH}
    workers = {"num_envs": 2, "num_workers": 2, "overwork": True}
    envs = vector.make(
        GamePufferEnv, env_kwargs=copies, backend=vector.Multiprocessing, **workers
    )  # fmt: skip
    observed, _ = envs.reset(seed=0)
    assert observed.shape == (12, 12)
    logs: list[dict[str, float]] = []
    for _ in range(40):
        *_, infos = envs.step(np.zeros((12, 2), np.float32))
        logs += infos
    envs.close()
    assert logs
    assert all(0 < log["episode_length"] <= ROUGH["max_cycles"] for log in logs)


def test_agents_of_different_sizes_share_a_space() -> None:
    env = GamePufferEnv(sizes(), 2, noise=0.0)
    env.reset(seed=0)
    assert env.single_action_space.shape == (2,)
    before = env.simulator.state.copy()
    env.step(np.ones((4, 2), np.float32))
    moved = env.simulator.state - before
    assert np.allclose(moved[:, :, 0], [4.0, 5.0]), "1 is the largest input"


def test_wrong_uses_are_refused() -> None:
    env = GamePufferEnv("head_on", 2)
    with pytest.raises(InputError, match="call reset first"):
        env.step(np.zeros((4, 2)))
    env.reset()
    for actions in (np.zeros((3, 2)), np.zeros(8), np.full((4, 2), "a")):
        with pytest.raises(InputError, match="actions"):
            env.step(actions)
    with pytest.raises(InputError, match=r"agent_1 in copy 0, not finite"):
        env.step(np.array([[0, 0], [np.nan, 0], [0, 0], [0, 0]]))
    with pytest.raises(InputError, match="reward_scale"):
        GamePufferEnv("head_on", reward_scale=0)
    for options in ({"reward_scale": "a"}, {"infos": "names"}, {"render_mode": "human"}):
        with pytest.raises(InputError, match=f"^{next(iter(options))}: is '"):
            GamePufferEnv("head_on", **options)
    for problem, unknown in {
        "^speeed: is not an option; perhaps you mean 'speed'": {"speeed": "l1"},
        "^num_envs: is not an option; perhaps you mean 'copies'": {"num_envs": 4},
        "use one of game, copies, .*shaping, reward_scale, .*seed,": {"qqq": 1},
        "^shaping: is 'x'; write True or False": {"shaping": "x"},
    }.items():
        with pytest.raises(InputError, match=problem):
            GamePufferEnv("head_on", **unknown)
    assert repr(env) == "GamePufferEnv('head_on', copies=2)"


def test_rewards_are_shaped_although_copies_restart_in_the_step() -> None:
    env, plain = (
        GamePufferEnv("intersection3", 20, shaping=shaping, **ROUGH) for shaping in (True, False)
    )
    env.reset(seed=0), plain.reset(seed=0)
    d, n = env.game.dim, env.simulator.state.shape[2]
    pace = straight_pace(env.game, env.simulator.tables.scale)
    ended = 0
    for _ in range(40):
        before = env.simulator.last.observation.copy()
        actions = to_goals(env)
        _, paid, *_ = env.step(actions)
        _, reward, *_ = plain.step(actions)
        out = env.simulator.last
        after = np.where(out.over[:, None, None], out.final_observation, out.observation)
        steps = [
            pace * np.linalg.norm(seen[..., :d], axis=2) * seen[..., n + d]
            for seen in (before, after)
        ]
        change = env.simulator.lam * (steps[0] - steps[1])
        np.testing.assert_allclose(paid, reward + change.ravel(), atol=1e-5)
        ended += int(out.over.sum())
    assert ended > 20


def test_episodes_draw_and_observe_what_the_rule_says() -> None:
    rule = Randomize(lam=Uniform(0.1, 0.9), agents=Choice([2, 3]))
    env = GamePufferEnv("intersection3", 8, randomize=rule, seed=0, **ROUGH)
    observed, _ = env.reset(seed=0)
    ended = 0
    for _ in range(40):
        lam = observed.reshape(8, 3, -1)[..., -3]  # its own
        present = lam > 0
        assert ((lam[present] >= 0.1) & (lam[present] <= 0.9)).all()
        assert present[:, :2].all()
        assert not env.masks.reshape(8, 3)[~present].any()
        observed, rewards, _, _, infos = env.step(to_goals(env))
        assert (rewards.reshape(8, 3)[~present] == 0).all()
        ended += bool(infos)
    assert ended > 3
    assert len(np.unique(lam)) > 8
