"""Rules of random draws: what is drawn, what observations say, and that episodes are valid."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test

from ppg_env import (
    GameVectorEnv,
    HalfSpaces,
    InputError,
    Obstacle,
    Polytope,
    Simulator,
    SingleAgentEnv,
    make_game,
    parallel_env,
    path_planning_v0,
)
from ppg_env.env import Choice, Near, Randomize, Rules, Uniform
from ppg_env.env.arrival_regions import check_starts
from ppg_env.env.draw_streams import DrawStreams

FIELD = Uniform([10.0, 10.0], [90.0, 90.0])
EVERYTHING = Randomize(
    start=FIELD,
    goal={0: FIELD, "agent_2": Choice([[20.0, 20.0], [80.0, 80.0]])},
    lam=Uniform(0.1, 0.9),
    noise=Uniform(0.0, 4.0),
    size=Uniform(0.4, 1.2),
    agents=Choice([2, 3]),
    shared=("lam", "noise"),
)


def course() -> Any:
    """Walls, a moving obstacle, a workspace, and bodies that stay."""
    wall = Obstacle(Polytope.from_vertices([[40, 40], [60, 40], [60, 60], [40, 60]]))
    shuttle = Obstacle(Polytope.box([6, 6]), [[50.0, 90.0 - 8 * t] for t in range(8)])
    return make_game(
        "intersection3",
        obstacles=(wall, shuttle),
        within=HalfSpaces.between([0.0, 0.0], [100.0, 100.0]),
        on_goal="stay",
        start={0: [10.0, 50.0], 1: [50.0, 10.0], 2: [90.0, 90.0]},
        goal={0: [90.0, 50.0], 1: [50.0, 75.0], 2: [10.0, 10.0]},
    )


def test_every_episode_drawn_is_a_valid_game_and_the_draws_fill_their_ranges() -> None:
    simulator = Simulator(course(), copies=60, seed=2, randomize=EVERYTHING)
    simulator.reset()
    games = [simulator.game_of(c) for c in range(60)]  # raises where one is not valid
    for game in games:
        check_starts(game.agents, simulator.tables.tolerance[: len(game.agents)])
    assert {len(game.agents) for game in games} == {2, 3}
    agents = [agent for game in games for agent in game.agents]
    for values, low, high in (
        ([agent.lam for agent in agents], 0.1, 0.9),
        ([agent.noise[0, 0] for agent in agents], 0.0, 4.0),
        ([np.ptp(agent.shape.vertices[:, 0]) / 15 for agent in agents], 0.4, 1.2),
        ([agent.start[0] for agent in agents], 10.0, 90.0),
    ):
        width = high - low
        assert low <= min(values) < low + 0.1 * width
        assert high - 0.1 * width < max(values) <= high
    for game in games:
        assert len({agent.lam for agent in game.agents}) == 1, "lam is shared"
        assert len({round(float(np.ptp(a.shape.vertices[:, 0])), 9) for a in game.agents}) > 1
        assert game.agents[1].goal.tolist() == [50.0, 75.0], "agent 1 has no distribution of goals"


def test_observations_say_what_is_drawn_in_the_documented_order() -> None:
    simulator = Simulator(course(), copies=20, seed=0, randomize=EVERYTHING)
    plain = Simulator(course(), copies=20, seed=0)
    base = plain.observation_size
    simulator.reset()
    assert simulator.observation_size == base + 1 + 1 + 3 + 6
    g, values = simulator.tables, simulator.variation.values
    for c in range(20):
        game = simulator.game_of(c)
        playing = len(game.agents)
        size = [agent.shape.params[0][0] / 15 for agent in game.agents] + [0.0] * (3 - playing)
        place = [(agent.goal - g.centre) / g.scale for agent in game.agents]
        place += [np.zeros(2)] * (3 - playing)
        for i in range(playing):
            order = [i, *(j for j in range(3) if j != i)]
            noise = np.sqrt(game.agents[0].noise[0, 0]) / g.scale
            wanted = [game.agents[0].lam, noise, *(size[j] for j in order)]
            wanted += [k for j in order for k in place[j]]
            drawn = simulator.last.observation[c, i, base:]
            np.testing.assert_allclose(drawn, wanted, rtol=1e-5, atol=1e-6)
            state = simulator.last.observation[c, i, :2] * g.scale
            np.testing.assert_allclose(state, values.start[c, i] - values.goal[c, i], atol=1e-3)
        assert not values.playing[c, playing:].any()


def test_what_is_drawn_holds_for_the_episode_and_is_drawn_again_for_the_next() -> None:
    rule = Randomize(lam=Uniform(0.1, 0.9), noise=Uniform(0.5, 3.0), shared=("noise",))
    simulator = Simulator(make_game("head_on"), Rules(max_cycles=6), 30, 1, rule)
    last = simulator.reset()[..., -3:].copy()
    random, restarts = np.random.default_rng(0), 0
    for _ in range(20):
        lam, acting = simulator.lam.copy(), simulator.alive.copy()
        step = simulator.step(random.uniform(-10, 10, (30, 2, 2)))
        now = step.observation[..., -3:]
        assert np.array_equal(now[~step.over], last[~step.over])
        assert np.array_equal(step.final_observation[step.over][..., -3:], last[step.over])
        assert (now[step.over] != last[step.over]).all()
        np.testing.assert_allclose(now[..., 0], simulator.lam, rtol=1e-6)
        np.testing.assert_allclose(now[:, 0, 1], simulator.lam[:, 1], rtol=1e-6)
        quiet = acting & ~step.crashed
        np.testing.assert_allclose(step.reward[quiet], -lam[quiet])
        restarts += int(step.over.sum())
        last = now.copy()
    assert restarts >= 60


def test_drawn_noise_is_the_noise_of_the_steps() -> None:
    rule = Randomize(noise=Choice([0.0, 9.0]))
    simulator = Simulator(make_game("head_on"), copies=4000, seed=3, randomize=rule)
    simulator.reset()
    before, noise = simulator.state.copy(), simulator.variation.values.noise[..., 0, 0].copy()
    simulator.step(np.zeros((2, 2)))
    moves = simulator.state - before
    assert not moves[noise == 0].any()
    assert np.var(moves[noise == 9]) == pytest.approx(9.0, rel=0.05)
    assert (noise == 9).mean() == pytest.approx(0.5, abs=0.03)


def test_draws_depend_on_the_seed_the_copy_and_its_episode_alone() -> None:
    """Neither on the number of copies, nor on the others' episodes, nor on other views."""

    def starts(copies: int, action: float, seed: int = 5) -> dict[tuple[int, int], list[Any]]:
        simulator = Simulator(course(), Rules(max_cycles=9), copies, seed, EVERYTHING)
        simulator.reset()
        episode, drawn = np.zeros(copies, dtype=int), {}
        for _ in range(25):
            for c in range(3):
                values = simulator.variation.values
                drawn[c, int(episode[c])] = [*values.start[c].ravel(), *simulator.lam[c]]
            episode += simulator.step(np.full((3, 2), action)).over
        return drawn

    few, many, other = starts(3, 1.0), starts(40, -4.0), starts(3, 1.0, seed=6)
    both = few.keys() & many.keys()
    assert len(both) >= 6
    assert all(few[key] == many[key] for key in both)
    assert not any(few[key] == other[key] for key in few.keys() & other.keys())
    env = parallel_env(course(), randomize=EVERYTHING)
    env.reset(seed=5)
    assert env.simulator.variation.values.start[0].ravel().tolist() == few[0, 0][:6]


def test_the_uniform_numbers_are_uniform_and_independent() -> None:
    streams = DrawStreams(np.random.SeedSequence(1))
    copies, episodes = np.repeat(np.arange(200), 50), np.tile(np.arange(50), 200)
    numbers = np.hstack([streams.uniform(copies, episodes, word, size=3) for word in range(4)])
    assert 0 <= numbers.min() < numbers.max() < 1
    counts = np.histogram(numbers, bins=20, range=(0, 1))[0]
    assert ((counts - 6000) ** 2 / 6000).sum() < 45  # chi-square, 19 degrees of freedom
    correlation = np.corrcoef(numbers.T) - np.eye(12)
    assert np.abs(correlation).max() < 0.05
    ordered = numbers[:, 0].reshape(200, 50)
    assert abs(np.corrcoef(ordered[:, :-1].ravel(), ordered[:, 1:].ravel())[0, 1]) < 0.05
    assert abs(np.corrcoef(ordered[:-1].ravel(), ordered[1:].ravel())[0, 1]) < 0.05


def test_without_a_rule_observations_and_noise_are_as_ever() -> None:
    env, ruled = parallel_env("head_on"), parallel_env("head_on", randomize=Randomize())
    first, same = env.reset(seed=4)[0], ruled.reset(seed=4)[0]
    for _ in range(6):
        assert all(np.array_equal(first[a], same[a]) for a in env.agents)
        actions = {a: np.ones(2) for a in env.agents}
        first, same = env.step(actions)[0], ruled.step(actions)[0]
    assert env.simulator.variation is None


def test_given_values_are_not_drawn() -> None:
    env = parallel_env(course(), randomize=EVERYTHING)
    for seed in range(5):
        env.reset(seed=seed, options={"start": {1: [20.0, 80.0]}, "lam": 0.3, "agents": 3})
        assert env.simulator.state[0, 1].tolist() == [20.0, 80.0]
        assert env.simulator.lam.tolist() == [[0.3] * 3]
        assert len(env.agents) == 3
        starts = env.simulator.state[0, [0, 2]]
        env.reset()
        assert env.simulator.lam[0, 0] != 0.3
        assert not np.array_equal(env.simulator.state[0, [0, 2]], starts)
    with pytest.raises(InputError, match=r"overlaps obstacle\[0\]"):
        env.reset(options={"start": {1: [50.0, 50.0]}})


def test_hopeless_draws_end_with_a_sentence() -> None:
    rule = Randomize(start=Uniform([0.0, 0.0], [9.0, 9.0]))
    env = parallel_env("head_on", randomize=rule)
    words = r"randomize: found no valid episode in 32 tries; in the last one agent\[0\].start"
    with pytest.raises(InputError, match=words + r" overlaps agent\[1\].start .*; widen"):
        env.reset(seed=0)
    with pytest.raises(InputError, match="no valid episode"):
        parallel_env("head_on", randomize=Randomize(size=Uniform(20.0, 30.0))).reset(seed=0)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Randomize(lam=0.3), r"randomize.lam: is 0.3; give a Uniform"),
        (lambda: Randomize(lam={0: 0.3}), r"randomize.lam: is 0.3; give a Uniform"),
        (lambda: Randomize(shared=("start",)), "randomize.shared: names 'start'"),
        (lambda: Randomize(shared=("lam",)), "randomize.shared: names 'lam'"),
        (lambda: Randomize(agents=Choice([1.5])), "randomize.agents"),
        (lambda: Uniform(1.0, 0.0), "low <= high"),
        (lambda: Uniform([0, 0], [1, 1, 1]), "of one length"),
        (lambda: Uniform(0.0, np.nan), r"Uniform.high: has an entry that is not a finite"),
        (lambda: Near(-1.0), "not negative"),
        (lambda: Choice([]), "has no values"),
        (lambda: Choice([[1, 2], [3]]), "not made of numbers"),
    ],
)
def test_wrong_rules_are_refused(make: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        make()


@pytest.mark.parametrize(
    ("rule", "sentence"),
    [
        (Randomize(lam=Uniform(0.5, 1.0)), r"randomize.agent\[0\].lam: is 1"),
        (Randomize(lam=Near(0.6)), r"randomize.agent\[0\].lam: is -0.1"),
        (Randomize(lam=Uniform([0.1, 0.2], [0.3, 0.4])), "draws points of 2 numbers"),
        (Randomize(noise=Uniform(-1.0, 2.0)), "not a covariance"),
        (Randomize(size=Uniform(0.0, 2.0)), r"size: is 0"),
        (
            Randomize(start=Uniform([0.0] * 3, [1.0] * 3)),
            "start: draws points of 3 numbers; draw points of 2",
        ),
        (Randomize(start=Choice([1.0, 2.0])), r"start: is of shape \(1,\)"),
        (Randomize(goal={7: Near(1.0)}), "names agent 7 of 2"),
        (Randomize(goal={"bob": Near(1.0)}), "names agent 'bob'"),
        (Randomize(goal={"agent_0": Near(1.0), 0: Near(2.0)}), "goal: names agent 0 twice"),
        (Randomize(agents=Choice([2, 3])), "may be 3, and the game has 2"),
        ("lam", "randomize: is 'lam'"),
    ],
)
def test_rules_that_do_not_fit_the_game_are_refused(rule: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        parallel_env("head_on", randomize=rule)


@pytest.mark.parametrize("field", ["noise", "size"])
def test_margins_of_drawn_noise_or_bodies_are_refused(field: str) -> None:
    rule = Randomize(**{field: Uniform(1.0, 1.2)})
    with pytest.raises(InputError, match=rf"randomize.{field}: cannot change"):
        parallel_env("head_on", reward="margin", randomize=rule)


def test_rules_are_data() -> None:
    assert pickle.loads(pickle.dumps(EVERYTHING)) == EVERYTHING
    assert hash(copy.deepcopy(EVERYTHING)) == hash(EVERYTHING)
    assert eval(repr(Randomize(lam=Near(0.1)))) == Randomize(lam=Near(0.1))


@pytest.mark.parametrize("observation", ["box", "neighbours(k=2)", "lidar(rays=5)", "state"])
def test_other_observations_hold_what_is_drawn_within_limits(observation: str) -> None:
    env = parallel_env(course(), observation=observation, randomize=EVERYTHING)
    usual = parallel_env(course(), observation=observation)
    extra = {"box": 11, "neighbours(k=2)": 5, "lidar(rays=5)": 5, "state": 15}[observation]
    size = usual.observation_space("agent_0").shape[0]
    for seed in range(3):
        observations, _ = env.reset(seed=seed)
        for name, own in observations.items():
            assert own.size == size + extra
            assert env.observation_space(name).contains(own)
            values, i = env.simulator.variation.values, int(name[-1])
            drawn = own[-5:] if extra == 5 else own
            if extra == 5:
                assert drawn[0] == np.float32(values.lam[0, i])
                assert drawn[2] == np.float32(values.size[0, i])
    assert env.state().shape == env.state_space.shape
    assert env.state().size == usual.state().size + 15


def test_lidar_measures_to_bodies_of_the_drawn_size() -> None:
    rule = Randomize(size={1: Choice([2.0])})
    env = parallel_env("head_on", observation="lidar(rays=4)", randomize=rule)
    env.reset(seed=0)
    reach = env._observer.distances()[0, 0, 0]
    assert reach == pytest.approx(80.0 - 7.5 - 15.0)


@pytest.mark.filterwarnings("ignore::UserWarning")  # limits, and agents that never play
@pytest.mark.parametrize("sharing", ["selfish", "social"])
def test_the_official_tests_pass_with_missing_agents(sharing: str) -> None:
    options: dict[str, Any] = {"randomize": EVERYTHING, "sharing": sharing}
    parallel_api_test(path_planning_v0.parallel_env(course(), **options), num_cycles=100)
    api_test(path_planning_v0.env(course(), **options), num_cycles=60)
    parallel_seed_test(lambda: path_planning_v0.parallel_env(course(), **options))
    check_env(SingleAgentEnv(course(), 1, **options), skip_render_check=True)


def test_missing_agents_neither_pay_nor_collide_nor_are_seen() -> None:
    env = parallel_env("circle(5)", randomize=Randomize(agents=Choice([2])), sharing="social")
    alone = parallel_env(
        env.game.__class__(env.game.agents[:2], horizon=env.game.horizon), sharing="social"
    )
    observations, infos = env.reset(seed=0)
    alone.reset(seed=0)
    assert list(infos) == env.agents == ["agent_0", "agent_1"]
    width = 1 + 2
    assert not observations["agent_0"][6 + width :].any()
    simulators = env.simulator, alone.simulator
    random = np.random.default_rng(0)
    for _ in range(15):
        noise, action = random.standard_normal((1, 5, 2)), random.uniform(-9, 9, (5, 2))
        ours = simulators[0].step(action, noise, restart=False)
        theirs = simulators[1].step(action[:2], noise[:, :2], restart=False)
        assert np.array_equal(ours.reward[:, :2], theirs.reward)
        assert not ours.reward[:, 2:].any()
        assert not ours.terminated[:, 2:].any()
        assert not ours.acting[:, 2:].any()


def test_one_copy_of_the_vector_environment_is_the_single_one() -> None:
    single = SingleAgentEnv(course(), 1, randomize=EVERYTHING)
    envs = GameVectorEnv(course(), 1, learner=1, randomize=EVERYTHING, autoreset_mode="SameStep")
    wanted, observed = single.reset(seed=8)[0], envs.reset(seed=8)[0]
    ends = 0
    for _ in range(60):
        assert np.array_equal(wanted, observed[0])
        wanted, reward, terminated, truncated, _ = single.step(np.array([3.0, 4.0]))
        observed, rewards, *_ = envs.step(np.array([[3.0, 4.0]]))
        assert reward == rewards[0]
        if terminated or truncated:
            wanted, ends = single.reset()[0], ends + 1
    assert ends > 1


def test_a_learner_that_may_be_missing_is_refused() -> None:
    rule = Randomize(agents=Choice([1, 2, 3]))
    for make in (SingleAgentEnv, GameVectorEnv):
        with pytest.raises(InputError, match="learner, agent 1, would not play"):
            make("circle(3)", learner=1, randomize=rule)
    env = GameVectorEnv("circle(3)", learner=0, num_envs=8, randomize=rule)
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"options.agents: is 0"):
        env.reset(options={"agents": 0})


def test_a_rule_is_replaced_by_one_of_the_same_layout() -> None:
    """A curriculum: lam rises over training."""
    envs = GameVectorEnv("head_on", 16, randomize=Randomize(lam=Uniform(0.0, 0.1)))
    for high in (0.1, 0.5, 0.9):
        envs.randomize = Randomize(lam=Uniform(high - 0.1, high))
        observations, _ = envs.reset(seed=0)
        own = observations[:, -2]
        assert high - 0.1 <= own.min() <= own.max() <= high + 1e-6
    for rule in (Randomize(noise=Uniform(0, 1)), Randomize(lam=Near(0.1), shared=("lam",)), None):
        with pytest.raises(InputError, match=r"draws .* where observations hold lam"):
            envs.randomize = rule
    plain = parallel_env("head_on")
    plain.randomize = Randomize(start=Near(4.0))  # adds no entries
    plain.reset(seed=0)
    assert plain.simulator.state.tolist() != [[[10.0, 50.0], [90.0, 50.0]]]
    plain.randomize = None
    plain.reset(seed=0)
    assert plain.simulator.state.tolist() == [[[10.0, 50.0], [90.0, 50.0]]]


def test_copies_made_mid_episode_go_on_identically() -> None:
    env = parallel_env(course(), randomize=EVERYTHING)
    env.reset(seed=3)
    env.step({agent: np.ones(2) for agent in env.agents})
    twin = pickle.loads(pickle.dumps(env))
    for _ in range(40):
        if not env.agents:
            assert twin.agents == []
            env.reset()
            twin.reset()
        actions = {agent: np.full(2, 6.0) for agent in env.agents}
        ours, theirs = env.step(actions), twin.step(actions)
        assert ours[1] == theirs[1]
        assert np.array_equal(env.state(), twin.state())


def test_a_single_environment_shows_the_game_of_the_episode() -> None:
    rule = Randomize(start=Near(6.0), agents=Choice([2]), size=Uniform(0.5, 0.9))
    env = parallel_env("circle(3)", randomize=rule, render_mode="rgb_array")
    pictures = []
    for seed in (0, 0, 1):
        env.reset(seed=seed)
        pictures.append(env.render())
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
