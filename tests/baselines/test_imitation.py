"""Warm starts from feedback players: what the network imitates, and what it becomes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from baselines import cost_descent, evaluate_runs, imitation, ppo_shared, train_players, warm_start
from baselines.imitation import (
    Demonstration,
    feedback_players,
    imitate_feedback,
    make_demonstrations,
)
from baselines.policy import team_players
from baselines.ppo import make_learner, policy_of
from baselines.training_loop import Args, Learner
from ppg_env import Game, InputError, make_game
from ppg_env.env import evaluate
from ppg_env.env.players import straight_players
from tests.baselines.small import ROLLOUT
from tests.marks import first
from tests.solvers.feedback.line_games import line_agent, line_game

EPISODES = 1024


@pytest.fixture
def overtaking() -> Game:
    """A fast agent behind a slow one, which it must not run into."""
    return line_game(line_agent(0.0, 40.0), line_agent(25.0, 65.0, -6.0, 6.0))


@pytest.fixture
def few_examples(monkeypatch: pytest.MonkeyPatch) -> None:
    values = {"COPIES": 32, "ROUNDS": 2, "UPDATES": 200, "LAST_UPDATES": 600, "BATCH": 256}
    for name, value in values.items():
        monkeypatch.setattr(imitation, name, value)


def _imitate(learner: Learner, args: Args) -> list[Demonstration]:
    demonstrations = make_demonstrations(args, learner.env.learners)
    imitate_feedback(learner.model, demonstrations, np.random.default_rng(args.seed))
    return demonstrations


@pytest.mark.usefixtures("few_examples")
@pytest.mark.parametrize("sharing", first(1, ["social", "selfish"]))
def test_the_network_costs_much_less_than_straight_ways(overtaking: Game, sharing: str) -> None:
    args = Args(overtaking, sharing, None, imitate_feedback=True)
    learner = make_learner(args)
    _imitate(learner, args)
    network = team_players(overtaking, (policy_of(args, learner),))
    feedback = feedback_players(overtaking, sharing, None)
    straight = straight_players(overtaking)
    costs = [
        evaluate(overtaking, players, EPISODES).cost.mean()
        for players in (feedback, network, straight)
    ]
    assert costs[1] < 1.5 * costs[0] < 0.5 * costs[2]


@pytest.mark.slow
@pytest.mark.usefixtures("few_examples")
def test_descent_comes_closer_to_the_feedback_players(
    overtaking: Game, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cost_descent, "UPDATES", 600)
    args = Args(overtaking, "social", None, imitate_feedback=True)
    learner = make_learner(args)
    demonstrations = _imitate(learner, args)
    teams = [demonstrations[0].players, team_players(overtaking, (policy_of(args, learner),))]
    cost_descent.descend(learner.model, demonstrations, np.random.default_rng(0))
    teams.append(team_players(overtaking, (policy_of(args, learner),)))
    feedback, imitated, descended = (
        evaluate(overtaking, team, 2 * EPISODES).cost.mean() for team in teams
    )
    assert descended - feedback < 0.5 * (imitated - feedback)


@pytest.mark.usefixtures("few_examples")
@pytest.mark.parametrize("sharing", ["social", "selfish"])
def test_the_costs_of_an_agent_at_rest_decrease_towards_its_goal_where_the_way_is_free(
    overtaking: Game, sharing: str
) -> None:
    args = Args(overtaking, sharing, None, imitate_feedback=True)
    play = cost_descent._Play(make_demonstrations(args, [0, 1])[0], np.random.default_rng(0))
    costs, slopes = play._costs_and_slopes(
        np.array([[[[0.0], [0.05]]] * 2] * 32), np.zeros((32, 2), np.int64)
    )
    assert (slopes[:, 1] < -0.5).all()
    assert (costs[:, 1, 0] > costs[:, 1, 1]).all()
    assert (np.abs(slopes[:, 0]) < 0.1).all()  # it waits behind the other


def test_descent_leaves_a_network_as_it_is_where_players_know_no_costs(overtaking: Game) -> None:
    args = Args(overtaking, "social", None, imitate_feedback=True)
    learner = make_learner(args, copies=8)
    before = policy_of(args, learner)
    straight = Demonstration(learner.env, straight_players(overtaking))
    cost_descent.descend(learner.model, [straight], np.random.default_rng(0))
    assert policy_of(args, learner) == before


@pytest.mark.slow
@pytest.mark.usefixtures("few_examples")
def test_one_network_imitates_the_players_of_several_lam(
    overtaking: Game, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(imitation, "LAMS", 2)
    args = Args(overtaking, "social", (0.2, 0.8), imitate_feedback=True)
    learner = make_learner(args)
    both = _imitate(learner, args)
    assert [len(set(d.env.simulator.lam.ravel())) for d in both] == [1, 1]
    inputs = np.array(learner.env.reset())
    inputs[:, -1] = 0.2
    careful = policy_of(args, learner)(inputs)
    inputs[:, -1] = 0.8
    assert np.abs(policy_of(args, learner)(inputs) - careful).max() > 0.01


@pytest.mark.usefixtures("short_trainings")
def test_a_warm_start_reports_its_grids_rounds_and_updates(
    overtaking: Game, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(imitation, "LAMS", 2)
    monkeypatch.setattr(cost_descent, "REPORTED", 5)
    args = Args(overtaking, "social", (0.2, 0.8), imitate_feedback=True)
    texts: list[str] = []
    warm_start.warm_start(args, make_learner(args, copies=8), texts.append)
    assert texts == [
        "dynamic programming for lam 0.2, grid 1 of 2",
        "dynamic programming for lam 0.8, grid 2 of 2",
        "imitating feedback players, round 1 of 2",
        "imitating feedback players, round 2 of 2",
        "descending on expected costs, update 0 of 10",
        "descending on expected costs, update 5 of 10",
        "fitting the value network",
        "",
    ]


@pytest.mark.usefixtures("short_trainings")
def test_the_value_network_is_fitted_alone(overtaking: Game) -> None:
    args = Args(overtaking, "social", None, imitate_feedback=True)
    learner = make_learner(args)
    before = {name: value.clone() for name, value in learner.model.policy.state_dict().items()}
    warm_start._fit_critic(learner)
    changed = {
        name for name, value in learner.model.policy.state_dict().items()
        if not value.equal(before[name])
    }  # fmt: skip
    assert changed
    assert all("value_net" in name for name in changed)
    assert all(value.requires_grad for value in learner.model.policy.parameters())
    assert learner.model.num_timesteps == 0


@pytest.mark.usefixtures("short_trainings")
def test_a_training_says_that_its_start_was_warm_and_repeats(
    overtaking: Game, tmp_path: Path
) -> None:
    words = {"sharing": "social", "lam": None, "steps": 2 * ROLLOUT, "warm_start": "feedback"}
    learned = train_players(overtaking, **words)
    assert learned.name == "ppo-warm-social"
    assert learned.about["warm_start"] == "feedback"
    args = Args(overtaking, "social", None, steps=2 * ROLLOUT, imitate_feedback=True)
    kept = replace(args, checkpoint=tmp_path / "seed-0.pt")
    assert ppo_shared.train(kept) == learned.runs[0]
    assert ppo_shared.train(kept) == learned.runs[0]  # from the checkpoint
    with pytest.raises(InputError, match="another training"):
        ppo_shared.train(replace(kept, imitate_feedback=False))


@pytest.mark.usefixtures("short_trainings")
@pytest.mark.parametrize("method", ["independent", "best-response"])
def test_every_agent_with_a_network_of_its_own_imitates_its_player(
    overtaking: Game, method: str
) -> None:
    learned = train_players(overtaking, method, lam=None, steps=ROLLOUT, warm_start="feedback")
    assert len(learned.runs[0]) == 2
    assert np.isfinite(evaluate_runs(overtaking, [learned.players(overtaking)], 100).costs).all()


@pytest.mark.parametrize(
    ("game", "method", "start"),
    [
        ("intersection3", "shared", "feedback"),
        ("head_on", "off-policy", "feedback"),
        ("head_on", "shared", "cold"),
    ],
)
def test_starts_that_cannot_be_are_refused(game: str, method: str, start: str) -> None:
    with pytest.raises(InputError, match="warm_start"):
        train_players(make_game(game), method, warm_start=start)


@pytest.mark.slow
def test_ppo_after_a_warm_start_costs_little_more_than_the_feedback_optimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Half of the rounds and a fifth of the steps of a real training."""
    monkeypatch.setattr(imitation, "ROUNDS", 3)
    game = make_game("head_on", speed="l1", lam=0.8, objective="risk")
    words = {"sharing": "social", "lam": None, "steps": 400_000, "warm_start": "feedback"}
    warm = train_players(game, **words)
    optimum = feedback_players(game, "social", None)
    costs = evaluate_runs(game, [warm.players(game), optimum], 8 * EPISODES, groups=2).costs
    assert costs[0] < 1.03 * costs[1]
