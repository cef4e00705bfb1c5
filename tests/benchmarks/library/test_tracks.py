"""Learned tracks: their files, scores, and entries of learners."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from scipy.stats import trim_mean

from benchmarks.library.learned.costs import mean_costs
from benchmarks.library.learned.entries import read_entries
from benchmarks.library.learned.score import aggregate, interquartile_mean, scores
from benchmarks.library.learned.summary import ENTRY_HEADS, TRACK_HEADS, entry_rows, track_rows
from benchmarks.library.learned.track import FOLDER, SPLITS, Track, tracks

TRACKS = tracks()
ENDS = ("straight", "reference")

LEARNER = """
import numpy as np

RUNS = {runs}


def team(game, run):
    def act(observations):
        way = -observations[:, :2]  # from the agent to its goal
        return {speed} * way / np.maximum(np.abs(way).sum(axis=1, keepdims=True), 1e-9)

    return [act] * len(game.agents)
"""


@pytest.fixture
def folder(tmp_path):
    """A track with one game per split."""
    shutil.copytree(FOLDER / "circle4-drawn", tmp_path / "tracks" / "small")
    path = tmp_path / "tracks" / "small" / "games.json"
    about = json.loads(path.read_text())
    about["games"] = [next(g for g in about["games"] if g["split"] == split) for split in SPLITS]
    path.write_text(json.dumps(about))
    (path.parent / "entries.json").unlink(missing_ok=True)
    return tmp_path / "tracks"


def track(ppg, folder, *words, code=0):
    return ppg("library", "track", *words, "--tracks", folder, "--episodes", "200", code=code)


def learner(path, speed=10, runs=1):
    path.write_text(LEARNER.format(speed=speed, runs=runs))
    return path


@pytest.mark.parametrize("one", TRACKS, ids=lambda one: one.name)
def test_test_games_are_draws_of_the_rules(one):
    for split in SPLITS:
        games, rule = one.games(split), one.rule(split)
        assert len(games) >= 3
        low, high = rule.noise.low, rule.noise.high
        for test in games:
            assert low <= test.noise <= high
            assert rule.lam.low <= test.lam <= rule.lam.high
            assert test.reference < 0.9 * test.straight
            drawn = one.drawn(test)  # also checks that the layout is that of training
            assert [list(agent.start) for agent in drawn.agents] == list(map(list, test.start))
            for place, agent in zip(test.start, one.game.agents, strict=False):
                assert np.abs(place - agent.start).max() <= rule.start.distance + 1e-3
    assert one.rule("train") == one.rule("test") != one.rule("beyond")


@pytest.mark.slow
@pytest.mark.parametrize("one", TRACKS, ids=lambda one: one.name)
def test_both_ends_of_the_scale_are_what_the_players_cost(one):
    test = one.games("test")[0]
    episodes = one.about["episodes"]
    assert mean_costs(one, test, "straight", episodes) == pytest.approx([test.straight], rel=1e-6)
    if one.about["reference"] == "social":
        (cost,) = mean_costs(one, test, "social", episodes, limit=60)
        assert cost == pytest.approx(test.reference, rel=0.02)


def test_scores_are_zero_for_straight_flight_and_a_hundred_for_the_reference():
    straight, reference = np.array([20.0, 10.0]), np.array([8.0, 6.0])
    costs = np.array([straight, reference, (straight + reference) / 2])
    assert np.allclose(scores(costs, straight, reference), [[0, 0], [100, 100], [50, 50]])


@pytest.mark.parametrize("shape", [(1, 4), (3, 5), (5, 8)])
def test_the_interquartile_mean_is_the_trimmed_mean(shape):
    values = np.random.default_rng(0).normal(size=shape)
    assert np.isclose(interquartile_mean(values.ravel()), trim_mean(values.ravel(), 0.25))


def test_limits_come_from_trainings_within_games():
    random = np.random.default_rng(1)
    games = random.normal(90, 20, size=6)  # games differ much, trainings little
    alike = aggregate(games + random.normal(0, 0.1, size=(5, 6)))
    apart = aggregate(games + random.normal(0, 10.0, size=(5, 6)))
    assert alike.low <= alike.value <= alike.high
    assert alike.high - alike.low < 1 < apart.high - apart.low
    assert np.isnan(aggregate(games[None]).low)
    # As many limits as stated hold the mean of the whole population of trainings.
    held = 0
    for seed in range(40):
        trial = np.random.default_rng(seed).normal(90, 10, size=(10, 4))
        limits = aggregate(trial, seed)
        held += limits.low <= 90 <= limits.high
    assert 32 <= held <= 40


def test_a_learner_in_a_python_file_is_scored_kept_and_replaced(ppg, folder, tmp_path):
    slow, fast = (learner(tmp_path / f"{v}.py", v, runs=2) for v in (7, 10))
    words = ("small", "--label", "mine", "--by", "a test", "--submit", "--json")
    first = track(ppg, folder, *words, "--player", slow).json
    (entry,) = first["entries"]
    assert first["kept"]
    assert entry["runs"] == 2
    value, low, high = entry["scores"]["test"]
    assert low <= value <= high < 50
    assert len(entry["digest"]) == 64
    second = track(ppg, folder, *words, "--player", fast).json
    assert second["kept"]
    assert second["entries"][0]["scores"]["test"][0] > value
    assert not track(ppg, folder, *words, "--player", slow).json["kept"]
    content = read_entries(Track(folder / "small"))
    assert len(content["entries"]) == 1
    assert len(content["history"]) == 2
    assert "a test" in track(ppg, folder, "small").out
    (row,) = track(ppg, folder, "--json").json["tracks"]
    assert row["best"] == "mine"


def test_straight_flight_scores_about_zero(ppg, folder):
    answer = track(ppg, folder, "small", "--player", "straight", "--json").json
    assert abs(answer["entries"][0]["scores"]["test"][0]) < 3
    assert not answer["kept"]


@pytest.mark.slow
def test_pretrained_players_are_learners_of_a_track(ppg):
    words = ("library", "track", "head_on-drawn", "--player", "ppo-social", "--episodes", "100")
    answer = ppg(*words, "--label", "again", "--json").json
    (entry,) = [entry for entry in answer["entries"] if entry["player"] == "again"]
    assert entry["runs"] == 5
    assert entry["scores"]["test"][0] > 90


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import nothing_like_this", "fails"),
        ("RUNS = 1", "fails"),
        ("def team(game, run):\n    return [len]", "one callable per agent"),
        ("def team(game, run):\n    return [lambda o: o @ o] * len(game.agents)", "fails"),
        ("def team(game, run):\n    return [lambda o: o[:1]] * len(game.agents)", "shape"),
        ("def team(game, run):\n    return [lambda o: o[:, :2] * float('inf')] * 4", "finite"),
    ],
)
def test_a_learner_that_breaks_the_contract_is_refused(ppg, folder, tmp_path, text, said):
    path = tmp_path / "theirs.py"
    path.write_text(text)
    done = track(ppg, folder, "small", "--player", path, code=2)
    (line,) = [line for line in done.err.strip().splitlines() if line.startswith("ppg: ")][-1:]
    assert said in line
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    "words",
    [
        ("large",),
        ("--player", "straight"),
        ("small", "--player", "walker"),
        ("small", "--player", "nowhere.py"),
        ("small", "--player", "nowhere.npz"),
        ("small", "--player", "straight", "--submit"),
    ],
    ids=" ".join,
)
def test_a_mistake_is_one_sentence(ppg, folder, words):
    done = track(ppg, folder, *words, code=2)
    assert done.err.count("ppg: ") >= 1
    assert "Traceback" not in done.err


def test_without_a_checkout_the_message_says_what_to_do(ppg, tmp_path):
    done = track(ppg, tmp_path, "circle4-drawn", code=2)
    assert "clone the repository" in done.err


def test_every_entry_names_games_runs_and_author():
    for one in TRACKS:
        for entry in read_entries(one)["entries"]:
            assert entry["by"]
            for split in SPLITS:
                costs = np.array(entry["costs"][split])
                assert costs.shape == (len(one.games(split)), entry["runs"])
                ends = [[getattr(g, end) for g in one.games(split)] for end in ENDS]
                value = aggregate(scores(costs.T, *map(np.array, ends))).value
                assert value == pytest.approx(entry["scores"][split][0], abs=1e-3)


def test_tables_have_a_row_per_track_and_entry():
    assert [row[0] for row in track_rows()] == [f"`{one.name}`" for one in TRACKS]
    assert all(len(row) == len(TRACK_HEADS) for row in track_rows())
    assert len(entry_rows()) == sum(len(read_entries(one)["entries"]) for one in TRACKS)
    assert all(len(row) == len(ENTRY_HEADS) for row in entry_rows())
