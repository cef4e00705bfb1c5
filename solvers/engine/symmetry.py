r"""Symmetries of a game: turns and mirrors about a centre that map it to itself.

A symmetry is a signed permutation Q of the axes with a permutation g of the agents, such that
agent g(i) is agent i seen in the mirror: start, goal, bodies, inputs, noise, gain, dynamics, lam,
and what each of its encounters is worth.  Plans of equal cost then come in orbits, and of those
one is enough.  States are positions and their derivatives, d components each, all turned alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from ppg_env.game.objective import Objective
from ppg_env.game.polytope import Polytope


@dataclass(frozen=True)
class Symmetry:
    """One of them.

    Attributes
    ----------
    agents, encounters : images of their indices.
    faces : per encounter, (F,) images of the faces of its collision set.
    """

    agents: tuple[int, ...]
    encounters: tuple[int, ...]
    faces: tuple[tuple[int, ...], ...]

    def moved(self, arrivals: Mapping[int, int]) -> tuple[int, ...]:
        """The arrivals of all agents, seen in the mirror."""
        result = [0] * len(self.agents)
        for i, time in arrivals.items():
            result[self.agents[i]] = time
        return tuple(result)


def identity(game: Game) -> Symmetry:
    """The symmetry that every game has."""
    faces = tuple(tuple(range(len(e.collision.offsets))) for e in game.encounters)
    everything = range(len(game.encounters))
    return Symmetry(tuple(range(len(game.agents))), tuple(everything), faces)


def symmetries(objective: Objective) -> list[Symmetry]:
    """All of them, the identity first; games of unusual states have only that one."""
    game = objective.game
    first = game.agents[0]
    d, n, m = game.dim, first.state_dim, first.control_dim
    alike = all((a.state_dim, a.control_dim) == (n, m) for a in game.agents)
    found = [identity(game)]
    if not alike or n % d or m % d or d > 3:
        return found
    centre = np.zeros(n)
    centre[:d] = np.mean([agent.start[:d] for agent in game.agents], axis=0)
    for order, signs in product(permutations(range(d)), product((1.0, -1.0), repeat=d)):
        turn = np.eye(d)[list(order)] * np.array(signs)
        one = _symmetry(objective, turn, centre)
        if one is not None and one not in found:
            found.append(one)
    return found


def _symmetry(objective: Objective, turn: np.ndarray, centre: np.ndarray) -> Symmetry | None:
    game, agents = objective.game, []
    for i, agent in enumerate(game.agents):
        images = [
            j
            for j, other in enumerate(game.agents)
            if np.isclose(objective.time[i], objective.time[j], atol=0)
            and _mirrored(agent, other, turn, centre)
        ]
        if len(images) != 1:
            return None
        agents.append(images[0])
    obstacles = []
    for body in game.obstacles:
        images = [
            k
            for k, other in enumerate(game.obstacles)
            if _same(body, other, turn, centre[: game.dim]) is not None
        ]
        if len(images) != 1:
            return None
        obstacles.append(images[0])
    places = {(e.agents, e.obstacle): k for k, e in enumerate(game.encounters)}
    encounters, faces = [], []
    for k, encounter in enumerate(game.encounters):
        where = [agents[i] for i in encounter.agents]
        obstacle = None if encounter.obstacle is None else obstacles[encounter.obstacle]
        image = places[tuple(sorted(where)), obstacle]
        # r_i - r_j of the image counts from the lower index, whichever that has become.
        sign = -1.0 if sorted(where) != where else 1.0
        shift = centre[: game.dim] if encounter.obstacle is not None else np.zeros(game.dim)
        mapped = _same(encounter.collision, game.encounters[image].collision, sign * turn, shift)
        if mapped is None or not np.isclose(
            objective.encounter[k], objective.encounter[image], atol=0
        ):
            return None
        encounters.append(image)
        faces.append(mapped)
    return Symmetry(tuple(agents), tuple(encounters), tuple(faces))


def _mirrored(agent: Agent, other: Agent, turn: np.ndarray, centre: np.ndarray) -> bool:
    """Whether ``other`` is what ``agent`` looks like after the turn about the centre."""
    d = agent.dim
    state = np.kron(np.eye(agent.state_dim // d), turn)
    inputs = np.kron(np.eye(agent.control_dim // d), turn)
    part = centre[: agent.goal.size]
    goal = state[: agent.goal.size, : agent.goal.size]
    pairs = [
        (state @ (agent.start - centre), other.start - centre),
        (agent.A @ centre, centre),  # the turn is about a point that rests without inputs
        (state @ agent.A @ state.T, other.A),
        (state @ agent.B @ inputs.T, other.B),
        (inputs @ agent.gain @ state.T, other.gain),
        (state @ agent.noise @ state.T, other.noise),
        (state @ agent.sigma0 @ state.T, other.sigma0),
    ]
    if agent.goal.size != other.goal.size or agent.lam != other.lam:
        return False
    pairs.append((goal @ (agent.goal - part), other.goal - part))
    return (
        all(np.allclose(one, two, rtol=0, atol=tol.SYMMETRY) for one, two in pairs)
        and _same(agent.shape, other.shape, turn, np.zeros(d)) is not None
        and _same_controls(agent, other, inputs)
    )


def _same_controls(agent: Agent, other: Agent, turn: np.ndarray) -> bool:
    """Whether the turn makes every control set of ``agent`` that of ``other``, at all times."""
    mine, others = pieces(agent.control), pieces(other.control)
    return [first for first, _ in mine] == [first for first, _ in others] and all(
        _same(one, two, turn, np.zeros(one.dim)) is not None
        for (_, one), (_, two) in zip(mine, others, strict=True)
    )


def _same(
    body: Polytope, other: Polytope, turn: np.ndarray, centre: np.ndarray
) -> tuple[int, ...] | None:
    """Images of the faces of ``body`` if the turn about ``centre`` makes it ``other``."""
    if body.normals.shape != other.normals.shape:
        return None
    normals = body.normals @ turn.T
    offsets = body.offsets - body.normals @ centre + normals @ centre
    near = np.abs(normals[:, None] - other.normals[None]).max(axis=2) <= tol.FACE
    near &= np.abs(offsets[:, None] - other.offsets[None]) <= tol.FACE * (
        1 + np.abs(offsets[:, None])
    )
    if not (near.sum(axis=1) == 1).all():
        return None
    images = tuple(near.argmax(axis=1).tolist())
    return images if len(set(images)) == len(images) else None
