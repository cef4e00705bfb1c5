"""Control sets that change over time, from the constructor to plans, files and pictures of them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import Agent, Game, InputError, Polytope, evaluate, make_game, make_plan, straight_plan
from ppg_env.formats.game_file import game_from_tables, game_to_tables
from ppg_env.game.input_sets import bounds, excess, later, pieces, room, spans
from ppg_env.game.reachability import earliest_arrival
from tests.ppg_env.strategies import changing, controls

FAST, SLOW, STILL = Polytope.box([20.0, 20.0]), Polytope.l1(5.0), Polytope.box([0.0, 0.0])
TIRING = ((0, FAST), (3, SLOW), (7, STILL))


def agent(control: object, **fields: object) -> Agent:
    values = {"start": [0.0, 0.0], "goal": [40.0, 0.0], "shape": Polytope.box([4.0, 4.0])}
    return Agent(**(values | {"control": control} | fields))


def test_the_set_of_a_step_is_the_last_one_that_has_begun() -> None:
    held = [agent(TIRING).control_at(t) for t in range(9)]
    assert held == [FAST] * 3 + [SLOW] * 4 + [STILL] * 2
    assert agent(TIRING).control_at(10**6) == STILL
    assert [agent(FAST).control_at(t) for t in (0, 99)] == [FAST, FAST]


def test_one_set_alone_is_the_same_agent_however_it_is_written() -> None:
    plain = agent(FAST)
    for written in (((0, FAST),), [[0, FAST]], [(np.int64(0), FAST)]):
        assert agent(written) == plain
        assert hash(agent(written)) == hash(plain)
        assert agent(written).control == FAST
    assert agent(TIRING) == agent(list(TIRING)) != plain
    assert agent(TIRING) != agent((*TIRING[:2], (8, STILL)))
    assert pickle.loads(pickle.dumps(agent(TIRING))) == agent(TIRING)


@pytest.mark.parametrize(
    ("control", "place"),
    [
        ((), "control:"),
        (((1, FAST),), r"control\[0\]"),
        ((FAST, SLOW), r"control\[0\]"),
        (((0, FAST), (5, None)), r"control\[1\]"),
        (((0, FAST), (5.0, SLOW)), r"control\[1\]"),
        (((0, FAST), (True, SLOW)), r"control\[1\]"),
        (((0, FAST), (0, SLOW)), r"control\[1\]"),
        (((0, FAST), (5, SLOW), (4, FAST)), r"control\[2\]"),
        (((0, FAST), (10_001, SLOW)), r"control\[1\]"),
        (((0, FAST), (5, Polytope.box([1.0]))), r"control\[1\]"),
        (((0, FAST), (5, SLOW, 6)), r"control\[1\]"),
    ],
)
def test_what_is_no_sequence_of_sets_is_refused_with_its_place(control: object, place: str) -> None:
    with pytest.raises(InputError, match=rf"^{place}"):
        agent(control)


@given(controls() | changing(), st.integers(0, 12), st.integers(0, 12))
def test_spans_and_later_sets_are_those_of_the_single_steps(
    control: object, first: int, steps: int
) -> None:
    mover, shifted = agent(control), agent(later(agent(control).control, first))
    for t in range(steps):
        assert shifted.control_at(t) == mover.control_at(first + t)
    held = [one for span, one in spans(mover.control, steps) for _ in range(steps)[span]]
    assert held == [mover.control_at(t) for t in range(steps)]


@given(controls() | changing(), st.integers(0, 2**32 - 1))
def test_the_box_holds_all_sets_and_the_excess_is_that_of_the_worst_step(
    control: object, seed: int
) -> None:
    mover = agent(control)
    low, high = bounds(mover.control)
    for _, held in pieces(mover.control):
        assert (held.vertices >= low).all()
        assert (held.vertices <= high).all()
    inputs = np.random.default_rng(seed).uniform(-15, 15, (9, 2))
    beyond = [mover.control_at(t).clearance(inputs[t]) for t in range(9)]
    assert excess(mover.control, inputs) == pytest.approx(max(beyond))
    assert excess(mover.control, inputs[:0]) == -np.inf


def test_room_says_how_many_times_an_input_fits_in_the_set_of_its_step() -> None:
    inputs = np.tile([2.0, -2.0], (8, 1))
    assert room(TIRING, inputs).tolist() == pytest.approx([5, 5, 5, 1.25, 1.25, 1.25, 1.25, 0])
    assert room(FAST, inputs[:2] / 1000).tolist() == [100, 100]
    assert room(FAST, inputs[:1] * 0).tolist() == [100]
    assert room(Polytope.from_vertices([[1, 1], [2, 1], [1, 2]]), inputs[:1]).tolist() == [0]


def test_the_evaluator_holds_every_control_against_the_set_of_its_step() -> None:
    game = Game((agent(((0, FAST), (2, SLOW))),), horizon=5)
    for first, beyond in ((0, 0.0), (1, 3.0 / np.sqrt(2))):
        inputs = np.zeros((5, 2))
        inputs[first : first + 2] = [[8.0, 0.0], [8.0, 0.0]]
        found = evaluate(game, (make_plan(game.agents[0], inputs),))
        assert found.residuals.control[0] == pytest.approx(beyond)
        assert any("leaves its set" in text for text in found.violations()) == (beyond > 0)


@pytest.mark.parametrize("kind", [lambda v: Polytope.box([2 * v] * 2), Polytope.l1, Polytope.disc])
@given(speeds=st.lists(st.integers(1, 8), min_size=1, max_size=3), far=st.integers(1, 20))
def test_a_point_mass_flies_straight_and_as_fast_as_can_be(
    kind: object, speeds: list[int], far: int
) -> None:
    sets = [(2 * k, kind(float(speed))) for k, speed in enumerate(speeds)]
    mover = agent(sets, goal=[float(far), 0.0])
    plan = straight_plan(mover, 30)
    assert plan is not None
    assert plan.arrival == earliest_arrival(mover, 30)
    assert excess(mover.control, plan.controls) <= 1e-7
    np.testing.assert_allclose(plan.means[:, 1], 0.0, atol=1e-9)
    # In whole steps, by adding up.
    gone = np.cumsum([0.0] + [speeds[min(t // 2, len(speeds) - 1)] for t in range(30)])
    assert plan.arrival == int(np.argmax(gone >= far - 1e-9))


@given(changing().filter(lambda sets: all(s.clearance(np.zeros(2)) < 0 for _, s in sets)))
def test_whatever_the_sets_no_plan_is_faster_nor_is_the_straight_line(control: object) -> None:
    mover = agent(control, goal=[10.0, 4.5])
    plan = straight_plan(mover, 30)
    way, flown, steps = mover.goal - mover.start, 0.0, 0
    while flown < 1 - 1e-9 and steps < 30:
        flown += float(room(later(mover.control, steps), way[None] / 10)[0]) / 10
        steps += 1
    arrival = None if plan is None else plan.arrival
    assert arrival == earliest_arrival(mover, 30)
    assert flown < 1 - 1e-9 or (arrival is not None and arrival <= steps)


def test_a_red_light_at_the_start_is_waited_for() -> None:
    plan = straight_plan(agent(((0, STILL), (3, FAST))), 15)
    assert plan is not None
    assert plan.arrival == 7
    np.testing.assert_allclose(plan.controls[:7, 0], [0, 0, 0, 10, 10, 10, 10])


def test_the_sets_survive_tables_and_an_override_replaces_them_all() -> None:
    game = Game((agent(TIRING), agent(FAST, start=[0.0, 20.0])), horizon=9)
    tables = game_to_tables(game)
    assert tables["agent"][0]["control"] == [
        {"box": [10.0, 10.0]},
        {"from": 3, "l1": 5.0},
        {"from": 7, "box": [0.0, 0.0]},
    ]
    assert tables["agent"][1]["control"] == {"box": [10.0, 10.0]}
    assert game_from_tables(tables, "again") == game
    written = [{"box": [9.0, 9.0]}, {"from": 4, "disc": 3.0}]
    one = make_game("head_on", control={1: written})
    assert one.agents[0].control == FAST
    assert one.agents[1].control == ((0, Polytope.box([18.0, 18.0])), (4, Polytope.disc(3.0)))
    assert make_game("head_on", control=TIRING).agents[1].control == TIRING
    with pytest.raises(InputError, match=r"^agent\[0\]\.control\[1\]"):
        make_game("head_on", control=[{"box": [9.0, 9.0]}, {"box": [1.0, 1.0]}])
