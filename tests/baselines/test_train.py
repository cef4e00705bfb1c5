"""Training by name: players come out that play, whatever the method, the workers, or the game."""

from __future__ import annotations

import numpy as np
import pytest

from baselines import evaluate_runs, train_players
from baselines.train import METHODS
from ppg_env import Agent, Game, InputError, Polytope, make_game
from ppg_env.env.players import straight_players


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_processes(game: Game) -> None:
    reports: dict[int, list[str]] = {1: [], 2: []}
    one, two = (
        train_players(game, seeds=[0, 1], steps=8192, jobs=jobs, activity=texts.append)
        for jobs, texts in reports.items()
    )
    assert sorted(reports[1]) == sorted(reports[2])
    assert "seed 1: imitating straight ways" in reports[2]
    assert two.runs == one.runs
    assert two.about == one.about
    assert two.runs[0] != two.runs[1]


def in_space() -> Game:
    """Three dimensions, an obstacle, unequal agents."""
    body = Polytope.box([4.0, 4.0, 4.0])
    common = {"shape": body, "gain": 0.5}
    return Game(
        (
            Agent([0, 0, 0], [40, 0, 0], control=Polytope.l1(9.0, 3), lam=0.2, **common),
            Agent([40, 20, 0], [0, 20, 5], control=Polytope.box([20.0] * 3), lam=0.6, **common),
        ),
        obstacles=(Polytope.from_vertices(body.vertices + np.array([20.0, 10.0, 0.0])),),
    )


def with_inertia() -> Game:
    """Double integrators: twice as many states as inputs."""
    A = np.block([[np.eye(2), np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    B = np.vstack([np.eye(2) / 2, np.eye(2)])
    agents = [
        Agent(
            [x, y, 0, 0],
            [-x, y],
            shape=Polytope.box([4.0, 4.0]),
            control=Polytope.disc(3.0),
            noise=0.01,
            A=A,
            B=B,
            gain=np.hstack([0.3 * np.eye(2), 0.8 * np.eye(2)]),
            lam=lam,
        )
        for x, y, lam in ((20, 0, 0.2), (-20, 8, 0.6))
    ]
    return Game(tuple(agents), horizon=25)


@pytest.mark.slow
@pytest.mark.usefixtures("short_trainings")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("make", "sharing"), [(in_space, "social"), (with_inertia, "selfish")])
def test_every_method_trains_players_of_any_game(make, method: str, sharing: str) -> None:
    """Nothing is special about the paper's games."""
    game = make()
    found = train_players(game, method, sharing=sharing, lam=None, steps=2048)
    assert found.name == f"{METHODS[method].prefix}-{sharing}"
    assert found.fits(game)
    (row,) = found.about["figures"]
    assert row["lam"] == [0.2, 0.6]
    judged = evaluate_runs(game, [found.players(game)], 100)
    assert np.isfinite(judged.costs).all()


@pytest.mark.slow
def test_ppo_learns_to_give_way() -> None:
    """From straight lines, which always crash, to hardly any crash, in a few seconds."""
    game = make_game("intersection", speed="l1")
    straight = evaluate_runs(game, [straight_players(game)], 2000)
    assert straight.crashes[0] > 0.99
    found = train_players(game, steps=400_000, seeds=[0])
    judged = evaluate_runs(game, [found.players(game)], 2000)
    assert judged.crashes[0] < 0.05
    assert judged.successes[0] > 0.95
    assert judged.costs[0] < 0.2 * straight.costs[0]


def test_unknown_methods_and_no_seeds_are_refused(game: Game) -> None:
    with pytest.raises(InputError, match="method"):
        train_players(game, "magic")
    with pytest.raises(InputError, match="seeds"):
        train_players(game, seeds=[])
    with pytest.raises(InputError, match="sharing"):
        train_players(game, sharing="kind", steps=10)
