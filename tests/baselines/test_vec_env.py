"""The bridge to stable-baselines3 shows and pays what the environment shows and pays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.wrappers import RescaleAction
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from baselines import GameVecEnv
from ppg_env import Game, InputError, Polytope, SingleAgentEnv, make_game, parallel_env
from ppg_env.env.players import GoToGoal
from ppg_env.env.rules import Rules


def rollout(env, steps, seed=0):
    """Random actions: observations, rewards, dones (steps, slots, ...), infos."""
    random = np.random.default_rng(seed)
    shape = (env.num_envs, env.action_space.shape[0])
    seen, paid, done, infos = [env.reset()], [], [], []
    for _ in range(steps):
        out = env.step(random.uniform(-1, 1, size=shape))
        for log, item in zip((seen, paid, done, infos), out, strict=True):
            log.append(item)
    return np.array(seen), np.array(paid), np.array(done), infos


@pytest.mark.parametrize("sharing", ["selfish", "social"])
def test_it_is_the_pettingzoo_environment_in_slots(sharing: str) -> None:
    """Without noise both must agree step by step, in any order of arrival."""
    game = make_game("intersection3", speed="l1", noise=0.0)
    bridge = GameVecEnv(game, Rules(sharing=sharing), 2, shaping=False, reward_scale=1.0)
    env = parallel_env(game, sharing=sharing)
    names = env.possible_agents
    random = np.random.default_rng(3)
    seen, _ = env.reset(seed=0)
    slots = bridge.reset().reshape(2, 3, -1)
    homing = [GoToGoal(game, i) for i in range(3)]
    for _ in range(60):
        for i, name in enumerate(names):
            if name in env.agents:
                np.testing.assert_array_equal(slots[0, i], seen[name])
        action = np.zeros((2, 3, 2))
        for i in range(3):
            toward = homing[i].act(bridge.simulator.view(i)) / 10
            action[:, i] = np.clip(toward + random.normal(size=2) * 0.3, -1, 1)
        acting = env.agents
        seen, rewards, _, _, _ = env.step(
            {name: 10 * action[0, names.index(name)] for name in acting}
        )
        flat, paid, done, infos = bridge.step(action.reshape(6, 2))
        slots, paid = flat.reshape(2, 3, -1), paid.reshape(2, 3)
        for i, name in enumerate(names):
            assert paid[0, i] == pytest.approx(rewards.get(name, 0.0), rel=1e-6)
        assert done[:3].all() == (not env.agents)
        assert done[:3].any() == done[:3].all()
        if not env.agents:
            for i, name in enumerate(names):
                if name in acting:
                    np.testing.assert_array_equal(infos[i]["terminal_observation"], seen[name])
            seen, _ = env.reset()
            break
    else:
        pytest.fail("no episode ended")
    np.testing.assert_array_equal(slots[0, 0], seen[names[0]])


def test_a_copy_ends_for_all_its_slots_at_once(game: Game) -> None:
    env = GameVecEnv(game, copies=16)
    _, paid, done, infos = rollout(env, 80)
    done, paid = done.reshape(80, 16, 2), paid.reshape(80, 16, 2)
    assert done.any()
    np.testing.assert_array_equal(done[..., 0], done[..., 1])
    for t in range(80):
        for slot, info in enumerate(infos[t]):
            assert bool(info) == done[t].ravel()[slot]
            if info:
                assert info["terminal_observation"].shape == env.observation_space.shape


def test_shaping_changes_returns_by_a_constant(game: Game) -> None:
    """Of episodes that do not run out of time: + lam times the straight way's steps."""
    totals = {}
    for shaping in (False, True):
        env = GameVecEnv(game, copies=64, shaping=shaping, reward_scale=1.0, seed=1)
        _, paid, done, infos = rollout(env, 40, seed=2)
        first = done.argmax(axis=0)
        ended = [k for k in range(128) if done[:, k].any()]
        totals[shaping] = {k: (paid[: first[k] + 1, k].sum(), infos[first[k]][k]) for k in ended}
    lam_steps = 0.5 * 8
    compared = 0
    for k, (plain, info) in totals[False].items():
        assert plain == pytest.approx(-info["cost"], rel=1e-5)
        if info["crashed"] or info["is_success"]:
            assert totals[True][k][0] == pytest.approx(plain + lam_steps, abs=1e-3)
            compared += 1
    assert compared > 5


def test_time_that_runs_out_is_reported_to_those_in_traffic_only() -> None:
    game = make_game("parallel", speed="l1")
    for bootstrap in (True, False):
        env = GameVecEnv(game, Rules(max_cycles=12), 4, bootstrap=bootstrap)
        env.reset()
        homing = GoToGoal(game, 0)
        for _ in range(12):
            action = np.zeros((4, 2, 2))
            action[:, 0] = env.normalised(0, homing.act(env.simulator.view(0)))
            _, _, done, infos = env.step(action.reshape(8, 2))
        assert done.all()
        for copy in range(4):
            home, waiting = infos[2 * copy], infos[2 * copy + 1]
            assert (home["is_success"], waiting["is_success"]) == (True, False)
            assert not home["TimeLimit.truncated"]
            assert waiting["TimeLimit.truncated"] == bootstrap


def test_lam_is_drawn_for_each_episode_seen_and_paid(game: Game) -> None:
    env = GameVecEnv(game, copies=32, weights=(0.2, 0.6), shaping=False, reward_scale=1.0, seed=4)
    seen, paid, done, _ = rollout(env, 60, seed=5)
    lam = seen[..., -1].reshape(61, 32, 2)
    np.testing.assert_array_equal(lam[..., 0], lam[..., 1])
    assert lam.min() >= 0.2
    assert lam.max() <= 0.6
    changes = np.diff(lam[..., 0], axis=0) != 0
    np.testing.assert_array_equal(changes, done.reshape(60, 32, 2)[..., 0])
    first = paid[0].reshape(32, 2)  # no agent can arrive or crash in the first step
    np.testing.assert_allclose(first, -lam[0], rtol=1e-6)


def test_a_seed_fixes_everything(game: Game) -> None:
    one, two, other = (
        rollout(GameVecEnv(game, copies=8, weights=(0.1, 0.9), seed=seed), 50)[:3]
        for seed in (7, 7, 8)
    )
    for a, b, c in zip(one[:2], two[:2], other[:2], strict=True):
        np.testing.assert_array_equal(a, b)
        assert not np.array_equal(a, c)
    env = GameVecEnv(game, copies=8, weights=(0.1, 0.9), seed=1)
    rollout(env, 10)
    env.seed(7)
    np.testing.assert_array_equal(rollout(env, 50)[1], one[1])


def test_one_learner_begins_again_as_soon_as_it_has_finished() -> None:
    """The others need not finish first, and a copy's partners play as given."""
    game = make_game("parallel", speed="l1", noise=0.0)
    env = GameVecEnv(game, copies=3, learners=[1], shaping=False, reward_scale=1.0)
    env.reset()
    for _ in range(8):  # 80 lengths at full speed, the region beginning 5 before the goal
        assert env.simulator.status.tolist() == [[0, 0]] * 3
        _, reward, done, infos = env.step(np.tile([1.0, 0.0], (3, 1)))
    assert done.all()
    assert reward.tolist() == [-0.5] * 3
    assert all(info["is_success"] for info in infos)
    assert env.simulator.clock.tolist() == [0, 0, 0]


def test_wrappers_of_stable_baselines3_work_on_it(game: Game) -> None:
    env = VecNormalize(VecMonitor(GameVecEnv(game, copies=8, weights=(0.1, 0.9))))
    PPO("MlpPolicy", env, n_steps=32, batch_size=128, n_epochs=1, seed=0, device="cpu").learn(1024)
    _, _, done, infos = rollout(env, 60)
    ended = [info["episode"] for line in infos for info in line if "episode" in info]
    assert len(ended) == done.sum()
    assert all(1 <= episode["l"] <= 30 for episode in ended)


def test_the_view_of_one_learner_is_a_gymnasium_environment_that_sb3_can_train_on() -> None:
    env = RescaleAction(SingleAgentEnv("intersection", learner=1), np.float32(-1), np.float32(1))
    check_env(env)
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=1, seed=0, device="cpu")
    model.learn(128)


def test_an_action_means_the_same_input_at_all_times_and_is_cut_off_at_the_set_that_holds() -> None:
    fast, slow = Polytope.box([20.0, 20.0]), Polytope.box([8.0, 8.0])
    game = make_game("head_on", control=((0, fast), (2, slow)), noise=0.0)
    env = GameVecEnv(game, copies=1)
    env.reset()
    for share, moved in ((0.3, 3.0), (1.0, 10.0), (0.3, 3.0), (1.0, 4.0)):
        before = env.simulator.state[0, 0, 1]
        env.step(np.tile([0.0, share], (2, 1)))
        assert env.simulator.state[0, 0, 1] - before == pytest.approx(moved)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        *(
            ({"learners": bad}, r"^learners: are .* of 2 agents; give different numbers")
            for bad in ([0, 2], [0, 0], [-1], [], 0, "01", ["agent_0"], [0.0], [True])
        ),
        ({"learners": [0], "players": {0: "x"}}, r"^players: names agent 0;"),
        ({"learners": [0], "players": {1: "x"}}, r"^players\[1\]: is 'x'; give an object with"),
        ({"reward_scale": 0.0}, r"^reward_scale: is 0\.0; give a positive number"),
        *(({"weights": bad}, r"^weights: are ") for bad in ((0.9, 0.1), (0.2, 1.0), (0.5,))),
    ],
)
def test_arguments_that_do_not_fit_are_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        GameVecEnv(make_game("head_on"), copies=2, **arguments)
    assert GameVecEnv(make_game("head_on"), copies=2, learners=np.array([1])).learners == [1]
