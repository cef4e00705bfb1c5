from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ppg_env import Agent, Game, InputError, Polytope, make_game, scenarios
from ppg_env.formats.game_file import game_to_toml
from ppg_env.game import Obstacle

CALLS_REFUSED = [
    "circle(",
    "circle)",
    "circle(0)",
    "circle(99999999)",
    "circle(-3)",
    'circle("a")',
    "circle(2.5)",
    "circle(True)",
    "circle(None)",
    "circle([3])",
    "circle(n=3, bogus=1)",
    "circle(3, 4, 5)",
    "circle(3, n=3)",
    "circle(3)(4)",
    "circle(3) + 1",
    "circle(3).horizon",
    "circle(*[3])",
    "circle(**{'n': 3})",
    "circle(3, radius=0)",
    "circle(3, radius=-5)",
    "circle(3, radius=1)",
    "circle(3, radius='wide')",
    "circle(3, radius=1e999)",
    "circle(3, radius=1e300)",
    "circle(" + "-" * 100_000 + "3)",
    "circle(" + "(" * 1000 + "3" + ")" * 1000 + ")",
    "circle(\x00)",
    "circle(10**2)",
    'circle(__import__("os"))',
    'circle(__import__("os").getpid())',
    "circle((lambda: 3)())",
    "circle(n=open('/etc/passwd'))",
    "circle([3 for _ in 'a'][0])",
    "head_on(3)",
    "registry()",
    "__import__('os')",
    "opposing_",
    "",
    " ",
    "nowhere/game.toml",
]


@pytest.mark.parametrize("text", CALLS_REFUSED, ids=lambda text: repr(text[:40]))
def test_a_call_that_does_not_fit_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(InputError) as caught:
        make_game(text)
    assert "\n" not in str(caught.value)
    assert ";" in str(caught.value)


def test_nothing_in_a_call_is_executed(tmp_path: Path) -> None:
    mark = tmp_path / "executed"
    for argument in (
        f"open({str(mark)!r}, 'w')",
        f"__import__('pathlib').Path({str(mark)!r}).touch()",
    ):
        with pytest.raises(InputError):
            make_game(f"circle({argument})")
    assert not mark.exists()


def test_the_error_of_an_unknown_scenario_names_the_nearest_one() -> None:
    with pytest.raises(InputError, match="'intersection3'"):
        make_game("intersecton3")
    with pytest.raises(InputError, match="head_on"):
        make_game("zzz")


@pytest.mark.parametrize(
    "text", ["circle(4)", "circle(n=4)", "circle( 4 )", "circle(4, radius=None)"]
)
def test_arguments_of_a_family_are_given_by_place_or_name(text: str) -> None:
    assert make_game(text).agents == make_game("circle(4)").agents


def test_a_family_without_arguments_takes_its_defaults() -> None:
    assert len(make_game("circle").agents) == len(make_game("circle()").agents) == 6
    assert np.linalg.norm(make_game("circle(10, radius=90)").agents[3].start) == pytest.approx(90)


def test_scenarios_lists_calls_that_work_and_says_what_they_are() -> None:
    listing = scenarios()
    assert {"opposing", "head_on", "parallel", "intersection", "intersection3"} <= set(listing)
    assert "circle(n=6, radius=None)" in listing
    for call, text in listing.items():
        assert make_game(call).agents
        assert text
        assert "\n" not in text


def test_a_file_is_a_game_with_overrides_like_any_other(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(game_to_toml(make_game("head_on")), encoding="utf-8")
    assert make_game(path) == make_game(str(path)) == make_game("head_on")
    assert make_game(path, lam=0.2, speed="l1") == make_game("head_on", lam=0.2, speed="l1")


@pytest.mark.parametrize(
    ("speed", "control"),
    [("box", Polytope.box([20, 20])), ("l1", Polytope.l1(10)), ("disc", Polytope.disc(10))],
)
def test_speed_names_a_control_set_of_top_speed_ten(speed: str, control: Polytope) -> None:
    assert all(agent.control == control for agent in make_game("head_on", speed=speed).agents)


def lams(game: Game) -> list[float]:
    return [agent.lam for agent in game.agents]


def test_lam_goes_to_all_or_to_each_or_to_one() -> None:
    assert lams(make_game("head_on", lam=0.2)) == [0.2, 0.2]
    assert lams(make_game("head_on", lam=[0.2, 0.8])) == [0.2, 0.8]
    assert lams(make_game("head_on", lam=(0.2, 0.8))) == [0.2, 0.8]
    assert lams(make_game("head_on", lam=np.array([0.2, 0.8]))) == [0.2, 0.8]
    assert lams(make_game("head_on", lam={1: 0.8})) == [0.5, 0.8]


def test_gain_is_a_number_a_matrix_or_a_list_of_numbers() -> None:
    matrix = [[0.5, 0.1], [0.0, 0.5]]
    for value, expected in [(0.3, [0.3, 0.3]), ([0.3, 0.6], [0.3, 0.6]), ({0: 0.3}, [0.3, 0.5])]:
        found = [agent.gain[0, 0] for agent in make_game("head_on", gain=value).agents]
        assert found == expected
    for agent in make_game("head_on", gain=matrix).agents:
        np.testing.assert_array_equal(agent.gain, matrix)


def test_every_field_can_be_overridden() -> None:
    wall = Polytope.from_vertices([[40, 0], [50, 0], [45, 20]])
    game = make_game(
        "head_on", horizon=20, margin_cap=4, objective="risk", crash_cost=7, scale="paper",
        name="mine", obstacles=[wall], start={0: [11, 50]}, goal={1: [6, 50]}, noise=2.5,
        sigma0=0.5, shape={"box": [10.0, 12.0]}, control={"disc": 9.0, "sides": 8},
        A=[[1, 0.1], [0, 1]], B=[[2, 0], [0, 2]],
    )  # fmt: skip
    assert (game.horizon, game.margin_cap, game.objective) == (20, 4.0, "risk")
    assert (game.crash_cost, game.scale, game.name) == (7.0, "paper", "mine")
    assert game.obstacles == (Obstacle(wall),)
    assert game.agents[0].start.tolist() == [11, 50]
    assert game.agents[1].goal.tolist() == [6, 50]
    for agent in game.agents:
        np.testing.assert_array_equal(agent.noise, 2.5 * np.eye(2))
        np.testing.assert_array_equal(agent.sigma0, 0.5 * np.eye(2))
        assert agent.shape == Polytope.box([10, 12])
        assert agent.control == Polytope.disc(9.0, 8)
        assert agent.A.tolist() == [[1, 0.1], [0, 1]]
        assert agent.B.tolist() == [[2, 0], [0, 2]]


def test_none_leaves_a_field_as_it_is() -> None:
    assert make_game("head_on", lam=None, horizon=None, speed=None) == make_game("head_on")


def test_a_change_of_objective_resets_the_cap_unless_one_is_given() -> None:
    assert make_game("head_on", margin_cap=7).margin_cap == 7
    assert make_game("head_on", objective="risk").margin_cap == 5
    assert make_game("head_on", objective="risk", margin_cap=7).margin_cap == 7
    assert make_game("head_on", objective="margin").margin_cap == 3


def test_the_cap_in_a_file_is_kept_unless_the_objective_changes(tmp_path: Path) -> None:
    path = tmp_path / "capped.toml"
    path.write_text(game_to_toml(make_game("head_on", margin_cap=7)), encoding="utf-8")
    assert make_game(path).margin_cap == 7
    assert make_game(path, objective="margin").margin_cap == 7
    assert make_game(path, objective="risk").margin_cap == 5


def test_an_override_of_the_control_set_has_as_many_inputs_as_the_agent(tmp_path: Path) -> None:
    body, control = Polytope.box([1.0] * 3), Polytope.box([9.0] * 3)
    path = tmp_path / "spatial.toml"
    path.write_text(game_to_toml(Game((Agent([0, 0, 0], [9, 9, 9], body, control),))), "utf-8")
    for override, expected in [
        ({"control": {"l1": 3.0}}, Polytope.l1(3.0, 3)),
        ({"control": {"box": [1, 2, 3]}}, Polytope.box([2, 4, 6])),
        ({"speed": "l1"}, Polytope.l1(10.0, 3)),
    ]:
        assert make_game(path, **override).agents[0].control == expected
    with pytest.raises(InputError, match="disc"):
        make_game(path, speed="disc")


@pytest.mark.parametrize(
    ("overrides", "place"),
    [
        ({"speeed": "l1"}, "speeed"),
        ({"agents": ()}, "agents"),
        ({"speed": "fast"}, "speed"),
        ({"speed": 3}, "speed"),
        ({"speed": "l1", "control": Polytope.l1(3)}, "speed"),
        ({"lam": 1.0}, r"agent\[0\]\.lam"),
        ({"lam": [0.1, 0.2, 0.3]}, "lam"),
        ({"lam": [0.1, 1.5]}, r"agent\[1\]\.lam"),
        ({"lam": []}, r"(agent\[0\]\.)?lam"),
        ({"lam": "0.5"}, r"(agent\[0\]\.)?lam"),
        ({"lam": {2: 0.5}}, "lam"),
        ({"lam": {-1: 0.5}}, "lam"),
        ({"gain": []}, r"(agent\[0\]\.)?gain"),
        ({"gain": [[1.0]]}, r"agent\[0\]\.gain"),
        ({"noise": -2.0}, r"agent\[0\]\.noise"),
        ({"start": [10.0, 50.0]}, r"agent\[0\]\.start"),
        ({"goal": [1.0]}, r"agent\[0\]\.goal"),
        ({"shape": {"bok": [1.0]}}, r"agent\[0\]\.shape"),
        ({"shape": 3}, r"agent\[0\]\.shape"),
        ({"control": {"l1": -1.0}}, r"agent\[0\]\.control"),
        ({"control": {"disc": 1.0, "sides": 2}}, r"agent\[0\]\.control"),
        ({"horizon": 0}, "horizon"),
        ({"margin_cap": -1}, "margin_cap"),
        ({"objective": "risky"}, "objective"),
        ({"obstacles": [5]}, "obstacle"),
        ({"obstacles": 5}, "obstacle"),
        ({"name": 5}, "name"),
    ],
    ids=lambda value: str(value)[:50],
)
def test_an_override_that_does_not_fit_is_refused_with_its_place(
    overrides: dict[str, object], place: str
) -> None:
    with pytest.raises(InputError, match=f"^{place}") as caught:
        make_game("head_on", **overrides)
    assert "\n" not in str(caught.value)


def test_the_rules_of_a_game_that_can_be_flown_are_overrides_too() -> None:
    wall = {"vertices": [[40, 0], [50, 0], [45, 20]]}
    corner = {"polygon": [[200, 0], [204, 0], [204, 1], [201, 1], [201, 4], [200, 4]]}
    guard = {"box": [2.0, 2.0], "path": [[0.0, 90.0], [5.0, 90.0]], "noise": 0.1, "until": 4}
    game = make_game(
        "head_on", collisions="swept", on_goal="stay", reserve=[0.5, 1.0], effort={1: 0.2},
        within={0: {"low": [-100.0, 0.0], "high": [float("inf"), 100.0], "sigmas": 2.0}},
        obstacles=[wall, corner, guard, Polytope.box([1.0, 1.0])],
    )  # fmt: skip
    assert (game.collisions, game.on_goal) == ("swept", "stay")
    assert [agent.reserve for agent in game.agents] == [0.5, 1.0]
    assert [agent.effort for agent in game.agents] == [0.0, 0.2]
    assert [len(agent.within) for agent in game.agents] == [1, 0]
    assert game.agents[0].within[0].sigmas == 2.0
    assert len(game.obstacles) == 5
    assert game.obstacles[3].path.tolist() == guard["path"]
    assert game.obstacles[3].until == 4
    assert (
        make_game("head_on", obstacles=wall).obstacles
        == make_game("head_on", obstacles=Polytope.from_vertices(wall["vertices"])).obstacles
    )


@pytest.mark.parametrize(
    ("overrides", "place"),
    [
        ({"obstacles": [{"vertces": [[0, 0]]}]}, r"obstacle\[0\]\.vertces: .*unknown.*'vertices'"),
        ({"obstacles": [{"polygon": [[0, 0]]}]}, r"obstacle\[0\]\.polygon"),
        ({"obstacles": [3]}, r"obstacle\[0\]"),
        ({"within": {"lo": [0.0]}}, r"agent\[0\]\.within\.lo: .*unknown.*'low'"),
        ({"reserve": [1.0]}, r"reserve: has 1 numbers"),
        ({"reserve": 99.0}, r"agent\[0\]\.reserve: leaves no control at step 1"),
        ({"effrt": 1.0}, r"effrt: is not a field of a game; perhaps you mean 'effort'"),
        ({"collisions": "sweep"}, r"collisions"),
    ],
)
def test_wrong_overrides_of_those_rules_are_reported_with_their_place(
    overrides: dict, place: str
) -> None:
    with pytest.raises(InputError, match=rf"^{place}"):
        make_game("head_on", **overrides)
