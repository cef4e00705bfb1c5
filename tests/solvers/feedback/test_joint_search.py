"""The search for joint actions against an enumeration of all pairs of actions."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env.env.rules import Rules
from solvers.feedback.grid.backward import solve_backward
from solvers.feedback.grid.choosers import JointOptimum
from solvers.feedback.grid.event_table import chances_of
from solvers.feedback.grid.joint_model import JointModel, make_joint_model
from tests.solvers.feedback.line_games import BODY, line_agent, line_game


class Recorded(JointOptimum):
    """Keeps the fields that were given and the costs that were chosen, stage by stage."""

    def __init__(self, model: JointModel) -> None:
        super().__init__(model)
        self.stages = []

    def choose(self, clock, fields, ahead):
        costs, choice = super().choose(clock, fields, ahead)
        self.stages.append((clock, [f.copy() for f in fields], dict(ahead), costs[0] + costs[1]))
        return costs, choice


def enumerated(model, clock, fields, ahead):
    """Least sum of costs (K0, K1) over all pairs of actions."""
    sides = [model.side(i, clock, ahead[i]) for i in range(2)]
    rows = []
    for side in sides:
        K, A, _ = side.index.shape
        row = np.zeros((K * A, K))
        np.add.at(
            row, (np.arange(K * A)[:, None], side.index.reshape(K * A, -1)),
            side.weight.reshape(K * A, -1),
        )  # fmt: skip
        rows.append(row)
    total = rows[0] @ (fields[0] + fields[1]).astype(float) @ rows[1].T
    before = [np.repeat(s.points, s.index.shape[1], axis=0) for s in sides]
    after = [s.ends.reshape(-1, 2).astype(float) for s in sides]
    pairs = [
        np.ascontiguousarray((a[:, None] - b[None]).reshape(-1, 2)) for a, b in (before, after)
    ]
    stays = [s.stays.reshape(-1) for s in sides]
    p = chances_of(model.risk, *pairs).reshape(total.shape) * np.outer(*stays)
    total += p * (model.crash.sum() - total)
    total += np.add.outer(*(s.cost.reshape(-1) for s in sides)) + model.lam.sum()
    (K, A), (L, B) = (s.index.shape[:2] for s in sides)
    return total.reshape(K, A, L, B).min(axis=(1, 3))


def stays_inside(model, agent):
    """Whether all moves from a grid point (K,) end on the grid."""
    grid, ends = model.grids[agent], model.moves(agent, 0).ends[..., 0]
    last = grid.low[0] + grid.step[0] * (grid.shape[0] - 1)
    return ((ends > grid.low[0] - 1e-6) & (ends < last + 1e-6)).all(axis=1)


@pytest.mark.parametrize(
    ("collisions", "drag", "speed"),
    [("instants", 1.0, 5.0), ("instants", 0.95, 6.0), ("swept", 1.0, 6.0)],
)
def test_search_agrees_with_an_enumeration(collisions, drag, speed):
    """Moves end on grid points and overlaps count at ends, or else agents search in turn.

    Where agents overlap already, a search in turn can end at a local minimum, and one of moves to
    grid points ends at the grid's border; crashed agents leave, so that this happens to none.
    """
    first = line_agent(0.0, 40.0, A=[[drag]])
    second = line_agent(25.0, 65.0, -speed, speed, A=[[drag]])
    game = line_game(first, second, collisions=collisions)
    model = make_joint_model(game, Rules(max_cycles=5), 2.5)
    chooser = Recorded(model)
    solve_backward(model, chooser, 1e9, None, None)
    states = [grid.points[:, 0] for grid in model.grids]
    apart = np.abs(np.subtract.outer(*states)) >= BODY
    inside = np.logical_and.outer(*(stays_inside(model, i) for i in range(2)))
    for clock, fields, ahead, found in chooser.stages:
        excess = found - enumerated(model, clock, fields, ahead)
        assert excess.min() > -1e-3
        assert excess[apart].mean() < 1e-3
        assert (excess[apart] > 1e-2).mean() < 0.01
        assert not model.separable or excess[inside].max() < 1e-3
    assert model.separable == (speed == 5.0)
