r"""What the bound of a pair needs of each of its agents, see :mod:`.pair_bound`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.rules import Rules
from ppg_env.game.agent import Agent
from ppg_env.game.polytope import Polytope
from solvers.feedback.bounds.solo_table import image, solo_table


@dataclass(frozen=True, eq=False)
class Mover:
    """One of two agents: what the bound needs of it.

    Attributes
    ----------
    agent : the agent.
    moves : corners (V, 2) of B U.
    pull : lam l.
    sigma : (2,) standard deviations of a step's noise.
    tolerance : (2,) half widths of the arrival region.
    """

    agent: Agent
    moves: np.ndarray
    pull: np.ndarray
    sigma: np.ndarray
    tolerance: np.ndarray

    @property
    def along(self) -> float:
        """Standard deviation of l w."""
        return float(np.linalg.norm(self.pull / self.agent.lam * self.sigma))

    @property
    def distance(self) -> float:
        """Steps l (g - x) at the start."""
        return float(self.pull @ (self.agent.goal - self.agent.start) / self.agent.lam)

    @property
    def back(self) -> float:
        """The most that an input can lose of l x."""
        return float((self.moves @ -self.pull).max() / self.agent.lam)


def make_mover(agent: Agent, tolerance: np.ndarray, rules: Rules) -> Mover | None:
    """Return the terms of an agent, None if the bound does not apply to it.

    Its l is the face of B U that bounds the steps to the goal; faces that tie are averaged.
    """
    plane = agent.state_dim == agent.dim == agent.goal.size == 2
    if not plane or not isinstance(agent.control, Polytope) or agent.lam == 0:
        return None
    noise = np.diag(agent.noise)
    plain = np.array_equal(agent.noise, np.diag(noise)) and (noise > tol.DEVIATION**2).all()
    still = np.array_equal(agent.A, np.eye(2)) and not agent.sigma0.any()
    if not plain or not still or rules.arrival != "region" or rules.saturation != "clip":
        return None
    moves = image(agent.B, agent.control)
    if len(moves) < 3:
        return None
    hull = Polytope("vertices", (moves,))
    if (hull.offsets <= 0).any():
        return None
    steps = hull.normals / hull.offsets[:, None]
    way = steps @ (agent.goal - agent.start)
    slope = steps[way >= way.max() - 1e-9 * (1 + way.max())].mean(axis=0)
    slope = slope / float((moves @ slope).max())
    return Mover(agent, moves, agent.lam * slope, np.sqrt(noise), tolerance)


def farthest(mover: Mover, direction: np.ndarray, time: int, sigmas: float) -> float:
    """Return the most of direction (x - start) up to ``time``."""
    step = float((mover.moves @ direction).max())
    return max(0.0, time * step) + sigmas * float(np.abs(direction) @ mover.sigma) * time**0.5


@dataclass(frozen=True)
class Rest:
    """What the linear term of one agent misses of its cost alone, as functions of one component.

    ``places`` are nodes, and ``least`` the minima over the cells from each of them on.
    """

    places: tuple[np.ndarray, np.ndarray]
    least: tuple[np.ndarray, np.ndarray]


def missing(mover: Mover, steps: int, time: int, leave: float, sigmas: float) -> Rest:
    """Return lam V(x) - lam l (g - x) at ``time``, least over the other component."""
    agent = mover.agent
    reach = sigmas * np.sqrt(time) * mover.sigma
    low = agent.start + time * mover.moves.min(axis=0) - reach
    high = agent.start + time * mover.moves.max(axis=0) + reach
    cover = tuple((float(low[a]), float(high[a])) for a in range(2))
    table = solo_table(agent, (0, 1), steps, mover.tolerance, leave=leave, cover=cover)
    spans, places = [], []
    for a, axis in enumerate(table.axes):
        first = int((low[a] - axis.low) // axis.spacing)
        last = int((high[a] - axis.low) // axis.spacing) + 1
        spans.append(slice(first, last + 1))
        places.append(axis.nodes[spans[a]])
    rest = agent.lam * table.value[spans[0], spans[1]]
    offset = [mover.pull[a] * (places[a] - agent.goal[a]) for a in range(2)]
    rest = rest + np.add.outer(*offset)
    hull = Polytope("vertices", (mover.moves,))
    spacing = np.array([axis.spacing for axis in table.axes])
    faces = [(n, time * b) for n, b in zip(hull.normals, hull.offsets, strict=True)]
    for normal, most in faces:
        ahead = np.add.outer(normal[0] * places[0], normal[1] * places[1]) - normal @ agent.start
        rest = np.where(ahead > most + np.abs(normal) @ (reach + spacing), np.inf, rest)
    ahead = np.add.outer(*(mover.pull[a] * places[a] for a in range(2))) - mover.pull @ agent.start
    most = agent.lam * (time + sigmas * mover.along * np.sqrt(time))
    rest = np.where(ahead > most + np.abs(mover.pull) @ spacing, np.inf, rest)
    least = [rest.min(axis=1 - a) for a in range(2)]
    cells = [np.minimum(line[:-1], line[1:]) for line in least]
    return Rest((places[0][:-1], places[1][:-1]), (cells[0], cells[1]))
