"""Actions that do not fit are refused by name before anything moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ppg_env import Agent, Game, InputError, Polytope, Simulator, SingleAgentEnv, make_game
from ppg_env import parallel_env as made
from ppg_env.env import episodes as arena
from ppg_env.env.players import GoToGoal, View
from ppg_env.env.rules import Rules


def test_actions_of_agents_that_have_left_are_ignored() -> None:
    """As libraries do that send every agent's action at every step."""
    plain, talkative = (made("intersection3", speed="l1", on_goal="remove") for _ in range(2))
    for env in (plain, talkative):
        env.reset(seed=4)
    left = 0
    while plain.agents:
        i = plain.possible_agents.index
        goal, state = plain.simulator.tables.goal, plain.simulator.state[0]
        actions = {a: goal[i(a)] - state[i(a)] for a in plain.agents}
        gone = {a: np.full(7, np.nan) for a in plain.possible_agents if a not in plain.agents}
        left += len(gone)
        one, other = plain.step(actions), talkative.step(gone | actions)
        assert one[1:4] == other[1:4]
        assert all(np.array_equal(one[0][a], other[0][a]) for a in one[0])
    assert left > 0
    assert talkative.step(dict.fromkeys(talkative.possible_agents, np.nan)) == ({}, {}, {}, {}, {})


def test_a_refused_step_leaves_no_trace() -> None:
    refused, plain = made("head_on"), made("head_on")
    for env in (refused, plain):
        env.reset(seed=1)
    good = {"agent_0": [5.0, 0.0], "agent_1": [0.0, 0.0]}
    for bad in ([np.nan, 0.0], [0.0, -np.inf], [1e30, 0.0], [0.0], "up"):
        with pytest.raises(InputError, match=r"^actions\['agent_1'\]: .*; give an array of shape"):
            refused.step(good | {"agent_1": bad})
    for env in (refused, plain):
        env.step(good)
    np.testing.assert_array_equal(refused.state(), plain.state())


@pytest.mark.parametrize(
    "bad",
    [
        np.array([1j, 2.0]),
        [1j, 2.0],
        np.array(["1", "2"]),
        np.array(["2020-01-01", "2020-01-02"], dtype="M8[D]"),
        np.array([1, 2], dtype="m8[s]"),
        np.array([None, 1], dtype=object),
        [10**400, 0],
    ],
    ids=repr,
)
def test_arrays_of_other_things_than_numbers_are_refused(bad: Any) -> None:
    """NumPy would convert them, and drop imaginary parts with a warning."""
    env = made("head_on")
    env.reset(seed=1)
    with pytest.raises(InputError, match=r"^actions\['agent_0'\]: .* not 2 finite numbers"):
        env.step({"agent_0": bad, "agent_1": [0.0, 0.0]})
    for fine in ([1, 2], (1.0, 2), np.array([1, 2], dtype=object), np.array([1, 2], np.uint8)):
        env.step({"agent_0": fine, "agent_1": [0.0, 0.0]})


def batch(copies: int = 3, **options: Any) -> Simulator:
    simulator = Simulator(make_game("head_on", **options), copies=copies, seed=0)
    simulator.reset()
    return simulator


SHAPES = [(2,), (3, 2), (2, 2, 2), (3, 1, 2), (3, 2, 1), (3, 2, 3), (6, 2), (1, 3, 2, 2), ()]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_the_simulator_refuses_other_shapes(shape: tuple[int, ...]) -> None:
    simulator = batch()
    before = simulator.state.copy()
    with pytest.raises(InputError, match=r"^action: has the shape .*\(3, 2, 2\), or \(2, 2\)"):
        simulator.step(np.zeros(shape))
    np.testing.assert_array_equal(simulator.state, before)


@pytest.mark.parametrize("action", [None, "left", [[1, 2], [3]], np.zeros((3, 2, 2), complex),
                                    np.zeros((3, 2, 2), object)], ids=repr)  # fmt: skip
def test_the_simulator_refuses_what_is_no_number(action: Any) -> None:
    with pytest.raises(InputError, match=r"^action: .*numbers"):
        batch().step(action)


def test_one_action_for_all_copies_is_broadcast_and_every_layout_read() -> None:
    random = np.random.default_rng(0)
    action = random.uniform(-12, 12, (2, 2)).astype(np.float32).astype(np.float64)
    whole = np.tile(action, (3, 1, 1))
    wide = np.zeros((3, 4, 2))
    wide[:, ::2] = whole
    frozen = whole.copy()
    frozen.setflags(write=False)
    states = []
    for form in (whole, action, action[None], action.astype(np.float32), whole.tolist(),
                 np.asfortranarray(whole), wide[:, ::2], frozen):  # fmt: skip
        simulator = batch()
        simulator.step(form)
        states.append(simulator.state.copy())
    for state in states[1:]:
        np.testing.assert_array_equal(state, states[0])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30])
def test_a_value_that_is_not_finite_is_refused_with_its_agent_and_copy(value: float) -> None:
    refused, plain = batch(), batch()
    action = np.zeros((3, 2, 2))
    action[2, 1, 0] = value
    with pytest.raises(InputError, match=r"^action\[2, 1\]: .*agent_1 in copy 2"):
        refused.step(action)
    np.testing.assert_array_equal(
        refused.step(np.zeros((3, 2, 2))).observation, plain.step(np.zeros((3, 2, 2))).observation
    )


def test_values_of_agents_that_have_left_and_of_inputs_that_none_has_are_ignored() -> None:
    body = Polytope.box([4.0, 4.0])
    narrow = Agent([0, 0], [0, 0], body, Polytope.box([2.0]), B=[[1.0], [0.0]], effort=1.0)
    wide = Agent([50, 0], [90, 0], body, Polytope.box([20.0, 20.0]))
    for start in ([0, 0], [0, 9]):  # at its goal, and on its way
        agents = (
            Agent(start, [0, 0], body, Polytope.box([2.0]), B=[[1.0], [0.0]], effort=1.0),
            wide,
        )
        ended = []
        for junk in (0.0, np.nan, 77.0):
            simulator = Simulator(Game(agents), Rules(saturation="none"), copies=2, seed=1)
            simulator.reset()
            action = np.ones((2, 2, 2))
            action[:, 0, 1] = junk
            if start == narrow.start.tolist():
                action[:, 0] = junk
            step = simulator.step(action, restart=False)
            ended.append((step.observation.copy(), step.time_cost.copy()))
        for each in ended[1:]:
            for one, other in zip(each, ended[0], strict=True):
                np.testing.assert_array_equal(one, other)


def test_noise_and_choices_of_another_shape_are_refused() -> None:
    simulator = batch()
    for shape in ((2, 2), (3, 2, 1), (4, 2, 2)):
        with pytest.raises(InputError, match=r"^noise: has the shape"):
            simulator.step(np.zeros((2, 2)), np.zeros(shape))
        with pytest.raises(InputError, match=r"^noise: has the shape"):
            simulator.reset(noise=np.zeros(shape))
    for chosen in ([True, False], np.ones(3), np.ones((3, 1), dtype=bool)):
        with pytest.raises(InputError, match=r"^chosen: .*3 truth values"):
            simulator.reset(chosen)
    with pytest.raises(ValueError, match="broadcast"):
        simulator.lam = np.zeros((4, 2))


STEPS: dict[str, tuple[Any, Callable[[Any], Any]]] = {
    "parallel": (lambda: made("head_on"), lambda env: env.step({})),
    "single": (lambda: SingleAgentEnv("head_on"), lambda env: env.step(np.zeros(2))),
    "simulator": (lambda: Simulator(make_game("head_on")), lambda env: env.step(np.zeros((2, 2)))),
}  # fmt: skip


@pytest.mark.parametrize("name", STEPS)
def test_a_step_before_the_first_reset_says_so(name: str) -> None:
    make, step = STEPS[name]
    env = make()
    with pytest.raises(InputError, match=r"^step: comes before the first reset; call reset first"):
        step(env)
    env.reset()
    if name != "parallel":
        step(env)


def test_copies_start_together_the_first_time() -> None:
    simulator = Simulator(make_game("head_on"), copies=2)
    with pytest.raises(InputError, match="reset all of them first"):
        simulator.reset(np.array([True, False]))


class Broken:
    """Plays the same row in every copy, whatever it is."""

    information = "open loop"

    def __init__(self, row: list[float]) -> None:
        self.row = np.array(row)

    def act(self, view: View) -> np.ndarray:
        return np.tile(self.row, (len(view.clock), 1))


def one_learner(row: list[float]) -> SingleAgentEnv:
    env = SingleAgentEnv("head_on", players={1: Broken(row)})
    env.reset(seed=0)
    return env


def test_a_learner_is_refused_by_name_and_so_are_its_partners() -> None:
    with pytest.raises(InputError, match=r"^actions\['agent_0'\]"):
        one_learner([0.0, 0.0]).step(np.full(2, np.nan))
    with pytest.raises(InputError, match=r"^actions\['agent_1'\]: is array\(\[nan"):
        one_learner([np.nan, 0.0]).step(np.zeros(2))
    with pytest.raises(InputError, match=r"^player of agent_1: returns an array of shape \(1, 3\)"):
        one_learner([0.0, 0.0, 0.0]).step(np.zeros(2))


def test_the_arena_refuses_shapes_and_values_by_name() -> None:
    game = make_game("head_on")
    for row, words in (([np.nan, 0.0], r"action\[0, 1\]: .*agent_1"), ([0.0], "player of agent_1")):
        with pytest.raises(InputError, match=words):
            arena.evaluate(game, [GoToGoal(game, 0), Broken(row)], 5)
