"""``ppg train`` and ``ppg regret``: files, figures, and what they say of themselves."""

from __future__ import annotations

import shlex

import pytest

from baselines import read_learned
from ppg_env import make_game
from ppg_env.formats.game_file import game_to_toml
from tests.baselines.small import ROLLOUT
from tests.solvers.feedback.line_games import line_agent, line_game

SHORT = ("--steps", str(ROLLOUT))

pytestmark = pytest.mark.usefixtures("short_trainings")


def test_a_training_is_written_reported_and_played(ppg, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = ppg("train", "intersection", "--speed", "l1", "--seeds", "2", *SHORT)
    assert "out/intersection-ppo-selfish.npz" in done.err
    assert "expected cost" in done.out
    learned = read_learned("out/intersection-ppo-selfish.npz")
    assert learned.fits(make_game("intersection", speed="l1", lam=0.3))
    assert learned.about["seeds"] == [0, 1]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["intersection-ppo-selfish.npz"]

    words = shlex.split(learned.about["command"])
    assert words == [
        "ppg",
        "train",
        "intersection",
        "--speed",
        "l1",
        "--steps",
        str(ROLLOUT),
        "--seeds",
        "2",
    ]
    ppg(*words[1:], "--out", "again.npz")
    assert read_learned("again.npz").runs == learned.runs

    report = ppg(
        "compare", "intersection", "--speed", "l1", "--episodes", "400", "--json",
        "--players", "straight,again.npz",
    ).json  # fmt: skip
    assert report["arena"] == "env"
    straight, row = report["rows"]
    assert (straight["runs"], row["runs"]) == (1, 2)
    assert row["information"] == "full state"
    assert straight["over_runs"] is None
    for name in ("expected_cost", "crash_probability", "success"):
        interval = row["over_runs"][name]
        assert interval["low"] <= interval["value"] <= interval["high"]


def test_json_has_the_figures(ppg, tmp_path):
    words = ["train", "parallel", "--lam", "0.3", *SHORT, "--out", tmp_path / "a.npz", "--json"]
    report = ppg(*words).json
    assert report["path"] == str(tmp_path / "a.npz")
    assert report["lam"] is None
    (row,) = report["figures"]
    assert row["lam"] == [0.3, 0.3]
    assert report["versions"]["torch"]
    assert read_learned(tmp_path / "a.npz").fits(make_game("parallel", lam=0.3))


def test_a_warm_start_is_in_the_name_and_in_the_command(ppg, tmp_path):
    game = line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0))
    path = tmp_path / "line.toml"
    path.write_text(game_to_toml(game))
    words = ["train", path, "--lam", "0.8", "--warm-start", "feedback", *SHORT]
    ppg(*words, "--out", tmp_path / "a.npz")
    learned = read_learned(tmp_path / "a.npz")
    assert learned.name == "ppo-warm-selfish"
    assert "--warm-start feedback" in learned.about["command"]


def test_tensorboard_logs_are_written_when_asked(ppg, tmp_path):
    logs = tmp_path / "logs"
    ppg("train", "parallel", *SHORT, "--out", tmp_path / "a.npz", "--tensorboard", logs)
    (folder,) = logs.iterdir()
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    events = EventAccumulator(str(folder)).Reload()
    assert {"game/cost", "game/arrived", "game/crashed", "train/value_loss"} <= set(
        events.Tags()["scalars"]
    )


@pytest.mark.slow
def test_regret_is_bounded_from_below_for_planners_and_learners(ppg, learned_file):
    words = ["--deviation", "planned", "--episodes", "500", "--speed", "l1", "--json"]
    for player in ("straight", str(learned_file)):
        report = ppg("regret", "intersection", "--player", player, *words).json
        assert [agent["agent"] for agent in report["agents"]] == ["agent_0", "agent_1"]
        for agent in report["agents"]:
            assert 0 <= agent["regret"]["low"] <= agent["regret"]["high"]
            assert set(agent["gains"]) == {"planned"}
    table = ppg("regret", "intersection", "--player", "straight", *words[:-1]).out
    assert "planned" in table


@pytest.mark.filterwarnings("default:.*another game")
def test_players_of_another_game_play_with_a_warning(ppg, learned_file):
    words = ["--players", learned_file, "--episodes", "50", "--json"]
    done = ppg("compare", "head_on", *words)
    assert done.json["rows"][0]["runs"] == 2
    assert "another game" in done.err


def test_a_pretrained_player_is_missing_for_other_games(ppg):
    done = ppg("compare", "circle(2)", "--players", "ppo-selfish", "--episodes", "10", code=2)
    assert "ppg train" in done.err
    assert done.out == ""


def test_learned_players_play_in_the_environment_only(ppg):
    words = ["--players", "ppo-selfish", "--arena", "schedule", "--episodes", "10"]
    assert "--arena env" in ppg("compare", "head_on", *words, code=2).err


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--method", "magic"], "shared"),
        (["--sharing", "kind"], "social"),
        (["--warm-start", "cold"], "straight or feedback"),
        (["--warm-start", "feedback", "--method", "off-policy"], "off-policy"),
        (["--lam-range", "0.5"], "two numbers"),
        (["--lam-range", "0.9,0.1"], "low <= high"),
        (["--lam-range", "a,b"], "write a number"),
        (["--out", "none/a.npz"], "no folder"),
        (["--out", "a.zip"], ".npz"),
    ],
    ids=" ".join,
)
def test_mistakes_are_reported_and_leave_nothing_behind(
    ppg, tmp_path, monkeypatch, words, reported
):
    monkeypatch.chdir(tmp_path)
    done = ppg("train", "parallel", *words, code=2)
    assert reported in done.err
    assert done.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_players_are_trained_and_tested_with_a_tolerance(ppg, tmp_path):
    words = ["train", "parallel", *SHORT, "--tolerance", "2.5", "--out", tmp_path / "a.npz"]
    ppg(*words)
    learned = read_learned(tmp_path / "a.npz")
    assert learned.about["tolerance"] == 2.5
    assert "--tolerance 2.5" in learned.about["command"]
    wide = ["regret", "intersection", "--speed", "l1", "--player", "straight"]
    wide += ["--deviation", "planned", "--episodes", "200"]
    plain, narrow = (ppg(*wide, *more, "--json").json for more in ([], ["--tolerance", "0.5"]))
    assert plain["agents"] != narrow["agents"]
