"""The players that come with the package: there are some for every game, and they fit."""

from __future__ import annotations

import shlex

import numpy as np
import pytest

from baselines import evaluate_runs, find_pretrained, read_learned
from baselines.pretrained import FROM_SCRATCH, WARM, available
from ppg_env import InputError, make_game
from ppg_env.formats.game_file import game_from_tables
from ppg_env.scenarios import paper
from ppg_env.scenarios.make import SPEEDS, override_game
from ppg_env.scenarios.registry import registry
from tests.marks import slow_if

PAPER = [name for name, function in registry().items() if function.__module__ == paper.__name__]
EPISODES = 4000
"""Of each run: a tenth of what the published figures come from, so that replaying is quick."""


@pytest.mark.parametrize("scenario", PAPER)
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("player", FROM_SCRATCH)
def test_every_scenario_of_the_paper_has_players(scenario: str, speed: str, player: str) -> None:
    check_origin(player, scenario, speed)


@pytest.mark.parametrize("player", WARM)
def test_warm_players_name_the_command_that_made_them(player: str) -> None:
    assert "--warm-start feedback" in check_origin(player, "head_on", "l1")


def check_origin(player: str, scenario: str, speed: str) -> str:
    """Check that a player has five runs, and a command of its own; return the command."""
    learned = find_pretrained(player, make_game(scenario, speed=speed, lam=0.3, gain=0.0))
    assert learned.name == player
    assert len(learned.runs) >= 5
    assert len(set(learned.about["seeds"])) == len(learned.runs)
    words = shlex.split(learned.about["command"])
    assert words[:3] == ["ppg", "train", scenario]
    assert words[-1] == f"baselines/pretrained/{scenario}-{speed}-{player}.npz"
    return str(learned.about["command"])


def test_other_games_have_none() -> None:
    with pytest.raises(InputError, match="ppg train"):
        find_pretrained("ppo-selfish", make_game("head_on", noise=3.0))
    with pytest.raises(InputError, match="ppg train"):
        find_pretrained("ppo-selfish", make_game("head_on", lam=0.99))
    with pytest.raises(InputError, match="--warm-start feedback"):
        find_pretrained("ppo-warm-social", make_game("intersection", speed="l1"))


@pytest.mark.parametrize(
    "path",
    slow_if(
        lambda path: path.stem not in ("head_on-l1-ppo-selfish", "intersection3-l1-ppo-selfish"),
        available(),
    ),
    ids=lambda path: path.stem,
)
def test_published_figures_are_replayed(path) -> None:
    """Other episodes, fewer of them: the figures of each run must agree within five deviations."""
    learned = read_learned(path)
    figures = learned.about["figures"]
    assert [row["lam"][0] for row in figures] == [0.2, 0.5, 0.8]
    row = figures[1]
    game = override_game(game_from_tables(learned.about["game"], "game"), lam=row["lam"])
    runs = [learned.players(game, r) for r in range(len(learned.runs))]
    judged = evaluate_runs(game, runs, EPISODES * len(runs), seed=99)
    for r, group in enumerate(judged.groups):
        crash = max(row["crash_probability_runs"][r], 1 / row["episodes"])
        unsure = 5 * np.sqrt(crash * (1 - crash) / EPISODES)
        assert abs(judged.crashes[r] - crash) < unsure + 1e-3
        spread = group.cost.mean(axis=1).std() + 50 * np.sqrt(crash)
        assert abs(judged.costs[r] - row["expected_cost_runs"][r]) < 5 * spread / EPISODES**0.5
        assert abs(judged.successes[r] - row["success_runs"][r]) < unsure + 1e-2


def test_published_figures_are_good() -> None:
    """At least 99 % arrive, in every paper scenario with two agents and l1 speed, at lam 0.5."""
    for path in available():
        learned = read_learned(path)
        if len(learned.about["game"]["agent"]) == 2 and "-l1-" in path.stem:
            assert learned.about["figures"][1]["success"]["value"] >= 0.99, path.stem


def test_a_replay_would_notice_other_weights() -> None:
    """The test above bites: a run played by another file's policy has other figures."""
    game = make_game("intersection", speed="l1")
    right, wrong = (find_pretrained(p, game) for p in FROM_SCRATCH)
    figures = right.about["figures"][1]["expected_cost_runs"]
    judged = evaluate_runs(game, [wrong.players(game, r) for r in range(5)], 5 * EPISODES, seed=99)
    assert np.abs(judged.costs - figures).max() > 0.02
