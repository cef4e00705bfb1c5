r"""Control laws of least effort: the way to the goal from any state, other agents ignored.

    u_0 = F x + f   minimises   sum_{l<k} |u_l - c|^2,   goal = A^k x + sum_{l<k} A^(k-1-l) B u_l

with u_l in the plane of the control set.  Its centre c is zero where zero is inside the set: a
one-sided set has no room for corrections around zero.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.polytope import Polytope


def least_effort_laws(
    agent: Agent, horizon: int, admissible: Polytope
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return (F, f) for k = 1..``horizon`` steps to go: the first control of least effort, F x + f.

    Numbers of steps that control fewer goal components than later ones are omitted; components
    that no control of the set ``admissible`` changes are left as they are.
    """
    select, power, along = goal_selector(agent), np.eye(agent.state_dim), admissible.directions
    centre = _centre(admissible)
    if along.shape[1] == 0:
        return [(np.zeros((agent.control_dim, agent.state_dim)), centre)]
    blocks: list[np.ndarray] = []
    drift = np.zeros(agent.state_dim)
    laws, ranks = [], []
    for _ in range(horizon):
        blocks.insert(0, power @ agent.B @ along)
        drift = agent.A @ drift + agent.B @ centre
        power = power @ agent.A
        effect = select @ np.hstack(blocks)
        first = along @ np.linalg.pinv(effect)[: along.shape[1]]
        laws.append((-first @ select @ power, first @ (agent.goal - select @ drift) + centre))
        ranks.append(np.linalg.matrix_rank(effect))
    return [law for law, rank in zip(laws, ranks, strict=True) if rank == max(ranks)]


def goal_responses(agent: Agent, horizon: int, admissible: Polytope) -> list[np.ndarray]:
    """Return how f of each of :func:`least_effort_laws` changes with the goal (g,): (m, g) each."""
    laws = least_effort_laws(agent, horizon, admissible)
    columns = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of growing errors: the game's agents have been reported
        for unit in np.eye(agent.goal.size):
            moved = least_effort_laws(replace(agent, goal=agent.goal + unit), horizon, admissible)
            columns.append([b[1] - a[1] for a, b in zip(laws, moved, strict=True)])
    return list(np.moveaxis(np.array(columns), 0, 2))


def _centre(admissible: Polytope) -> np.ndarray:
    zero = np.zeros(admissible.dim)
    return zero if admissible.clearance(zero) < 0 else admissible.vertices.mean(axis=0)
