"""The TorchRL environment against PettingZoo's, in TorchRL's checks, rollouts and collectors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppg_env import InputError, make_game, parallel_env
from ppg_env.env import Choice, GoToGoal, Randomize, Rules, Uniform
from tests.baselines.small_games import line, sizes, space

torch = pytest.importorskip("torch")
collectors = pytest.importorskip("torchrl.collectors", reason="needs the extra torchrl")

from tensordict.nn import TensorDictModule  # noqa: E402 - only where TorchRL is installed
from torchrl.envs import RewardSum, SerialEnv, StepCounter, TransformedEnv  # noqa: E402  # likewise
from torchrl.envs.utils import MarlGroupMapType, check_env_specs  # noqa: E402  # likewise

from baselines import GameTorchRLEnv, GameVecEnv  # noqa: E402  # likewise

pytestmark = pytest.mark.filterwarnings("default")  # those of TorchRL and tensordict

SCENARIOS = ("head_on", "intersection3", "circle(5)", "corridor", "intersection_3d")
ROUGH: dict[str, Any] = {"noise": 30.0, "max_cycles": 15}
"""With so much noise some agents arrive early, some crash and some are late."""


def to_goals(env: GameTorchRLEnv) -> Callable[[Any], Any]:
    """A policy of TorchRL that moves all agents straight to their goals."""
    players = [GoToGoal(env.game, i) for i in range(len(env.game.agents))]
    simulator = env.simulator

    def act(_: Any) -> Any:
        actions = np.zeros((*simulator.status.shape, simulator.action_size), np.float32)
        for i, player in enumerate(players):
            size = env.game.agents[i].control_dim
            actions[:, i, :size] = player.act(simulator.view(i))
        return torch.from_numpy(actions)

    return TensorDictModule(
        act, in_keys=[("agents", "observation")], out_keys=[("agents", "action")]
    )


@pytest.mark.parametrize("observation", ["relative", "box", "lidar", "state"])
@pytest.mark.parametrize("game", SCENARIOS)
def test_specs_hold(game: str, observation: str) -> None:
    if (game, observation) == ("intersection_3d", "lidar"):
        observation = "lidar(rays=5)"
    state = observation == "state"
    env = GameTorchRLEnv(game, 3, observation=observation, return_state=state, **ROUGH)
    check_env_specs(env, break_when_any_done="both", seed=0)
    assert env.full_action_spec_unbatched["agents", "action"].shape[0] == len(env.game.agents)
    assert ("state" in env.observation_spec.keys()) == state  # noqa: SIM118 - no mapping


@pytest.mark.parametrize("game", [line, sizes, space])
def test_specs_hold_in_games_of_any_size(game: Callable[[], Any]) -> None:
    env = GameTorchRLEnv(game(), 2, max_cycles=4)
    check_env_specs(env, seed=0)
    for group in env.group_map:
        space_of = env.full_action_spec[group, "action"].space
        assert (space_of.low < space_of.high).all(), "algorithms divide by the width"


@pytest.mark.parametrize("sharing", ["selfish", "social"])
@pytest.mark.parametrize("game", SCENARIOS)
def test_one_copy_is_the_pettingzoo_environment(game: str, sharing: str) -> None:
    single = parallel_env(game, sharing=sharing, **ROUGH)
    env = GameTorchRLEnv(game, 1, sharing=sharing, **ROUGH)
    policy, ends = to_goals(env), set()
    for seed in range(4):
        env.set_seed(seed)
        data, (observed, infos) = env.reset(), single.reset(seed)
        while not data["done"].item():
            data = env.step(policy(data))
            given = data["agents", "action"][0].numpy()
            actions = {name: given[i] for i, name in enumerate(single.possible_agents)}
            acting = single.agents
            observed, rewards, terminated, truncated, infos = single.step(actions)
            for i, name in enumerate(single.possible_agents):
                seen = data["next", "agents"][0, i]
                assert seen["mask"].item() == (name in single.agents)
                if name not in acting:
                    assert seen["reward"].item() == 0
                    continue
                assert np.array_equal(seen["observation"], observed[name])
                assert seen["reward"].item() == np.float32(rewards[name])
                assert seen["terminated"].item() == terminated[name]
                assert seen["truncated"].item() == truncated[name]
                for key, value in seen["info"].items():
                    assert value.item() == np.float32(infos[name][key]), key
                ends |= {key for key in ("arrived", "crashed") if infos[name][key]}
            data = data["next"]
    assert "crashed" in ends or "arrived" in ends


def test_copies_restart_in_the_step_in_which_they_end() -> None:
    env = GameTorchRLEnv("intersection3", 40, seed=3, **ROUGH)
    first = env.reset()["agents", "observation"].clone()
    data = env.rollout(60, policy=to_goals(env), auto_reset=False, tensordict=env.reset(),
                       break_when_any_done=False)  # fmt: skip
    after, over = data["next"], data["next", "done"].squeeze(-1)
    mask, ended = data["agents", "mask"], after["agents", "done"].squeeze(-1)
    assert over.sum() > 100
    assert (over == ended.all(dim=-1)).all()
    assert (over == (after["terminated"] | after["truncated"]).squeeze(-1)).all()
    following = data[:, 1:]["agents", "observation"]
    begun = over[:, :-1]
    assert torch.equal(following[begun], first[0].expand(int(begun.sum()), -1, -1))
    going = ~begun
    assert torch.equal(following[going], after[:, :-1]["agents", "observation"][going])
    assert not torch.isclose(after["agents", "observation"][over], first[0]).all(-1).any()
    assert data[:, 1:]["agents", "mask"][begun].all()
    assert not data[:, 1:]["agents", "info", "crashed"][begun].any()
    early = ~mask
    assert early.sum() > 50, "some agents end before their copy does"
    assert not after["agents", "reward"].squeeze(-1)[early].any()
    assert ended[early].all()
    assert (ended == after["agents", "mask"].logical_not()).all()
    info = after["agents", "info"]
    for key in ("arrived", "crashed"):
        assert (info[key].squeeze(-1) & mask & ended).sum() > 50
    cost = info["time_cost"] + info["safety_cost"]
    assert torch.allclose(after["agents", "reward"][mask], -cost[mask])


def test_the_social_reward_comes_until_the_copy_ends() -> None:
    env = GameTorchRLEnv("intersection3", 20, sharing="social", seed=3, **ROUGH)
    data = env.rollout(40, policy=to_goals(env), break_when_any_done=False)
    assert data["agents", "mask"].all()
    rewards = data["next", "agents", "reward"]
    assert torch.equal(rewards, rewards[:, :, :1].expand_as(rewards))
    assert data["next", "done"].sum() > 20


@pytest.mark.parametrize("game", SCENARIOS)
def test_collectors_go_on_over_ends(game: str) -> None:
    env = TransformedEnv(GameTorchRLEnv(game, 10, seed=1, **ROUGH))
    env.append_transform(RewardSum(in_keys=[("agents", "reward")], reset_keys=["_reset"]))
    env.append_transform(StepCounter())
    policy = to_goals(env.base_env)
    kind = getattr(collectors, "Collector", None) or collectors.SyncDataCollector  # old
    collector = kind(env, policy, frames_per_batch=200, total_frames=600)
    ends = 0
    for data in collector:
        assert data.shape == (10, 20)
        assert data["next", "step_count"].max() <= ROUGH["max_cycles"]
        ends += int(data["next", "done"].sum())
        over = data["next", "done"].squeeze(-1)
        assert (data["next", "agents", "episode_reward"][over] < 0).all()
    collector.shutdown()
    assert ends >= 30


def test_copies_that_are_over_stay_as_they_are_until_they_are_reset() -> None:
    env = GameTorchRLEnv("head_on", 30, seed=5, **ROUGH)
    policy, data, ends = to_goals(env), env.reset(), np.zeros(30)
    while not data["done"].all():
        over, bodies = data["done"].squeeze(-1).numpy(), env.simulator.bodies.copy()
        after = env.step(policy(data))["next"]
        assert np.array_equal(env.simulator.bodies[over], bodies[over])
        assert after["done"].squeeze(-1).numpy()[over].all()
        assert not after["agents", "reward"].numpy()[over].any()
        assert (after["agents", "terminated"] >= data["agents", "terminated"]).all()
        data, ends = after, ends + ~over
    assert len(set(ends)) > 3


def test_steps_of_some_copies() -> None:
    env, twin = (GameTorchRLEnv("head_on", 4, seed=5) for _ in range(2))
    data = env.rand_action(env.reset())
    twin.reset()
    all_of_them = twin.step(data.clone())["next"]
    before = env.simulator.bodies.copy()
    data["_step"] = torch.tensor([True, False, True, False])
    some = env.step(data)["next"]
    assert np.array_equal(env.simulator.bodies[1::2], before[1::2])
    assert torch.equal(
        some["agents"][::2]["observation"], all_of_them["agents"][::2]["observation"]
    )
    assert some["agents"]["reward"].squeeze(-1).any(dim=1).tolist() == [True, False, True, False]
    assert not some["agents", "info", "time_cost"][1::2].any()


def test_tensors_are_the_caller_s_and_a_seed_fixes_the_noise() -> None:
    trails = []
    for seed in (7, 7, 8):
        env = GameTorchRLEnv("head_on", 2, noise=3.0)
        env.set_seed(seed)
        first = env.reset()
        kept = first.clone()
        env.step(first.update(env.full_action_spec.zero()))
        second = env.step(env.reset().update(env.full_action_spec.zero()))["next"]
        trails.append(second["agents", "observation"])
        assert (kept == first.select(*kept.keys(True, True))).all()
    assert torch.equal(trails[0], trails[1])
    assert not torch.equal(trails[0], trails[2])
    assert not torch.equal(trails[0][0], trails[0][1]), "copies differ"


def test_agents_are_grouped_by_their_stems() -> None:
    from dataclasses import replace

    game = make_game("intersection3")
    names = ("car_0", "van_0", "car_1")
    game = replace(
        game, agents=tuple(replace(a, name=n) for a, n in zip(game.agents, names, strict=True))
    )
    plain, grouped = GameTorchRLEnv("intersection3", 5, seed=0), GameTorchRLEnv(game, 5, seed=0)
    check_env_specs(grouped)
    assert grouped.group_map == {"car": ["car_0", "car_1"], "van": ["van_0"]}
    assert plain.group_map == {"agents": ["agent_0", "agent_1", "agent_2"]}
    plain.set_seed(0), grouped.set_seed(0)
    data, other = plain.rand_action(plain.reset()), grouped.reset()
    other["car", "action"] = data["agents", "action"][:, [0, 2]]
    other["van", "action"] = data["agents", "action"][:, [1]]
    after, split = plain.step(data)["next", "agents"], grouped.step(other)["next"]
    for key in ("observation", "reward", "done"):
        assert torch.equal(after[key][:, [0, 2]], split["car", key])
        assert torch.equal(after[key][:, [1]], split["van", key])
    each = GameTorchRLEnv("head_on", group_map=MarlGroupMapType.ONE_GROUP_PER_AGENT)
    check_env_specs(each)
    assert list(each.group_map) == ["agent_0", "agent_1"]


def test_torchrl_makes_batches_of_it() -> None:
    env = SerialEnv(2, lambda: GameTorchRLEnv("head_on", 3, **ROUGH))
    check_env_specs(env)
    env.set_seed(0)
    data = env.rollout(40, break_when_any_done=False)
    assert data.shape == (2, 3, 40)
    assert data["next", "done"].sum() >= 12
    env.close()


def test_wrong_uses_are_refused() -> None:
    env = GameTorchRLEnv("head_on", 2)
    data = env.rand_action(env.full_observation_spec.zero())
    with pytest.raises(InputError, match="call reset first"):
        env.step(data)
    data = env.rand_action(env.reset())
    data["agents", "action"][1, 0, 0] = torch.nan
    with pytest.raises(InputError, match=r"agent_0 in copy 1, not finite"):
        env.step(data)
    for problem, options in {
        "^speeed: is not an option; perhaps you mean 'speed'": {"speeed": 1},
        "^num_envs: is not an option; perhaps you mean 'copies'": {"num_envs": 4},
        "use one of game, copies, .*group_map, return_state, .*seed, device,": {"qqq": 1},
        "^shaping: is 'x'; write True or False": {"shaping": "x"},
        "^reward_scale: is 0; give a positive number": {"reward_scale": 0},
        "copies": {"copies": 0},
        "observation": {"observation": "sonar"},
        "^render_mode: is 'rgb_array'; leave it out": {"render_mode": "rgb_array"},
        "^infos: is 'names'; leave it out": {"infos": "names"},
        "put every agent in one group": {"group_map": {"a": ["agent_0"]}},
    }.items():
        with pytest.raises(InputError, match=problem):
            GameTorchRLEnv("head_on", **options)


@pytest.mark.parametrize("shape", [(4, 2, 1), (4, 2, 3), (4, 1, 2), (4, 2)])
def test_actions_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    env = GameTorchRLEnv("head_on", 4)
    data = env.reset()
    before = env.simulator.bodies.copy()
    data["agents"].batch_size = [4]
    data["agents", "action"] = torch.zeros(shape)
    remedy = r"give numbers of shape \(copies, agents, inputs\) = \(4, 2, 2\)\."
    with pytest.raises(InputError, match=rf"^agents\.action: has the shape .*; {remedy}"):
        env.step(data)
    assert np.array_equal(env.simulator.bodies, before)


def test_actions_that_are_missing_or_no_real_numbers_are_refused() -> None:
    env = GameTorchRLEnv("head_on", 4)
    with pytest.raises(InputError, match=r"^agents\.action: is missing; give numbers"):
        env.step(env.reset())
    for kind in (torch.bool, torch.complex64):
        data = env.reset()
        data["agents", "action"] = torch.zeros(4, 2, 2, dtype=kind)
        with pytest.raises(InputError, match=rf"^agents\.action: has .* the type {kind}"):
            env.step(data)


def test_its_text_names_the_game_and_the_copies() -> None:
    assert repr(GameTorchRLEnv("intersection3", 4)) == "GameTorchRLEnv('intersection3', copies=4)"


@pytest.mark.parametrize("sharing", ["selfish", "social"])
def test_rewards_are_shaped_as_for_stable_baselines3(sharing: str) -> None:
    game, options = make_game("intersection3", noise=30.0), {"sharing": sharing, "max_cycles": 15}
    env = GameTorchRLEnv(game, 8, shaping=True, reward_scale=10.0, seed=0, **options)
    other = GameVecEnv(game, Rules(**options), 8)
    env.simulator.seed(5), other.simulator.seed(5)
    data, _ = env.reset(), other.reset()
    policy, rewards = to_goals(env), 0
    for _ in range(40):
        data = policy(data)
        scaled = (data["agents", "action"].numpy() / env.simulator.high).reshape(24, -1)
        step, data = env.step_and_maybe_reset(data)
        _, paid, done, _ = other.step(scaled)
        given = step["next", "agents", "reward"].numpy().reshape(24)
        np.testing.assert_allclose(given, paid, atol=1e-5)
        assert (step["next", "done"].numpy().repeat(3, 1).ravel() == done).all()
        rewards += (given != 0).sum()
    assert rewards > 100


def test_episodes_draw_and_observe_what_the_rule_says() -> None:
    rule = Randomize(lam=Uniform(0.1, 0.9), agents=Choice([2, 3]))
    env = GameTorchRLEnv("intersection3", 8, randomize=rule, return_state=True, seed=0, **ROUGH)
    check_env_specs(env, break_when_any_done="both", seed=0)
    data = env.rollout(40, to_goals(env), break_when_any_done=False)
    lam = data["agents", "observation"][..., env.simulator.observation_size - 3]  # its own
    present = lam > 0
    assert 0.1 <= lam[present].min() < 0.3
    assert 0.7 < lam[present].max() <= 0.9
    assert present[..., :2].all()
    assert 0 < present[..., 2].float().mean() < 1
    assert not data["agents", "mask"][~present].any()
    assert (data["next", "agents", "reward"].squeeze(-1)[~present] == 0).all()
    assert data["next", "done"].sum() > 8, "copies with missing agents end as well"
    env.randomize = replace(rule, lam=Uniform(0.9, 0.9))
    lam = env.reset()["agents", "observation"][:, 0, env.simulator.observation_size - 3]
    assert lam.tolist() == pytest.approx([0.9] * 8)
