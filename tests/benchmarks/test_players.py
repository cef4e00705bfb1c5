"""The registry of players: what each accepts is what it uses, and the rest is refused."""

from __future__ import annotations

import inspect

import pytest

from benchmarks.commands import VERBS
from benchmarks.comparison.players import PLAYERS, entrant, entrants, find_player
from ppg_env import make_game
from solvers.planner_options import DEFAULTS, PlannerOptions

OTHER = {
    "time_limit": 9.0,
    "node_limit": 500,
    "start": "sequential",
    "order": "random",
    "charge": "pigou",
}


GRID = ("feedback-nash", "feedback-social", "pairwise-nash", "pairwise-social")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=[pytest.mark.slow, pytest.mark.nightly] if n in GRID else [])
        for n in PLAYERS
    ],
)
def test_a_player_accepts_options_that_exist_and_declares_what_it_sees(name):
    player = PLAYERS[name]
    assert set(player.accepts) <= set(DEFAULTS)
    game = make_game("head_on", speed="l1")
    ready = entrant(name, game, PlannerOptions())
    (first, *_) = ready.policies(game, PlannerOptions())
    assert {one.information for one in first} == {player.information.split(",")[0]}


def test_the_optimum_starts_from_the_cheapest_plans_of_the_others():
    game, few = make_game("circle(4)"), PlannerOptions(node_limit=1)
    alone = entrant("social", game, few).solution
    social, straight, nash = entrants(["social", "straight", "nash"], game, few)
    assert [e.name for e in (social, straight, nash)] == ["social", "straight", "nash"]
    assert social.solution.evaluation.social_cost <= nash.solution.evaluation.social_cost
    assert social.solution.evaluation.social_cost < alone.evaluation.social_cost


def test_a_file_of_learned_players_is_a_player(learned_file):
    player = find_player(str(learned_file))
    assert (player.accepts, player.arena) == ((), "env")


def test_options_that_a_player_does_not_accept_are_left_at_their_defaults():
    options = PlannerOptions(seed=3, **OTHER)
    receding = options.only(PLAYERS["receding-social"].accepts)
    assert (receding.seed, receding.node_limit) == (3, int(OTHER["node_limit"]))
    assert (receding.start, receding.order, receding.charge) == (None, "cyclic", "selfish")


@pytest.mark.parametrize("option", OTHER)
@pytest.mark.parametrize("solution", ["nash", "potential", "social", "best-response"])
def test_solve_refuses_just_the_options_without_effect(ppg, solution, option):
    accepts = {"best-response": ("solver", "time_limit", "charge")}
    accepts |= {name: player.accepts for name, player in PLAYERS.items()}
    words = ["solve", "parallel", "--solution", solution]
    words += [f"--{option.replace('_', '-')}", OTHER[option]]
    if option in accepts[solution]:
        ppg(*words)
        return
    done = ppg(*words, code=2)
    assert f"{words[-2]}: has no effect for {solution}; leave it out, or choose " in done.err
    assert done.err.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        ["compare", "head_on", "--players", "straight,ppo-selfish", "--time-limit", "9"],
        ["risk", "head_on", "--player", "straight", "--time-limit", "9"],
        ["sweep", "head_on", "--players", "nash,straight", "--node-limit", "9"],
    ],
    ids=" ".join,
)
def test_an_option_that_no_chosen_player_accepts_is_refused(ppg, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    done = ppg(*words, code=2)
    assert f"{words[-2]}: has no effect for {words[3].replace(',', ', ')}; leave it out" in done.err
    assert list(tmp_path.iterdir()) == []


def test_an_option_that_one_player_accepts_is_for_that_player(ppg):
    words = ["compare", "parallel", "--players", "straight,nash", "--time-limit", "9"]
    assert ppg(*words, "--episodes", "10", "--json").json["rows"]


@pytest.mark.parametrize("verb", VERBS)
def test_no_command_takes_its_options_one_by_one(verb):
    """Groups of options arrive as one object each: at most 12 parameters."""
    own = inspect.unwrap(VERBS[verb])
    assert len(inspect.signature(own).parameters) <= 12
