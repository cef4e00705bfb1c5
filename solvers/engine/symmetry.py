r"""Symmetries of a game: rotations and reflections about a centre that map it to itself.

A symmetry is a signed permutation Q of the axes with a permutation g of the agents, such that
agent g(i) is the image of agent i: start, goal, bodies, inputs, noise, gain, dynamics, lam, and the
weights of its encounters.  Plans of equal cost then come in orbits, and one of each is searched.
States are positions and their derivatives, d components each, all mapped by Q.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    """One symmetry of a game.

    Attributes
    ----------
    agents, encounters : images of the indices of agents and encounters.
    faces : per encounter, (F,) images of the faces of its collision set.
    """

    agents: tuple[int, ...]
    encounters: tuple[int, ...]
    faces: tuple[tuple[int, ...], ...]

    def moved(self, arrivals: Mapping[int, int]) -> tuple[int, ...]:
        """Return the image of the arrivals of all agents."""
        result = [0] * len(self.agents)
        for i, time in arrivals.items():
            result[self.agents[i]] = time
        return tuple(result)


def identity(game: Game) -> Symmetry:
    """Return the symmetry that maps every agent to itself."""
    faces = tuple(tuple(range(len(e.collision.offsets))) for e in game.encounters)
    agents, encounters = range(len(game.agents)), range(len(game.encounters))
    return Symmetry(tuple(agents), tuple(encounters), faces)


def symmetries(objective: Objective) -> list[Symmetry]:
    """Return all symmetries, the identity first.

    Where states are no positions and derivatives of equal dimensions, or there are workspaces or
    moving obstacles, it is the only one.
    """
    game = objective.game
    first = game.agents[0]
    d, n, m = game.dim, first.state_dim, first.control_dim
    alike = all((a.state_dim, a.control_dim) == (n, m) for a in game.agents)
    result = [identity(game)]
    plain = all(obstacle.path is None for obstacle in game.obstacles)
    plain = plain and not any(agent.within for agent in game.agents)
    if not alike or not plain or n % d or m % d or d > 3:
        return result
    centre = np.zeros(n)
    centre[:d] = np.mean([agent.start[:d] for agent in game.agents], axis=0)
    for order, signs in product(permutations(range(d)), product((1.0, -1.0), repeat=d)):
        turn = np.eye(d)[list(order)] * np.array(signs)
        symmetry = _symmetry(objective, turn, centre)
        if symmetry is not None and symmetry not in result:
            result.append(symmetry)
    return result


def _symmetry(objective: Objective, turn: np.ndarray, centre: np.ndarray) -> Symmetry | None:
    """Return the symmetry of a turn about ``centre``, if the turn maps the game to itself."""
    game, tau = objective.game, objective.time

    def maps(i: int, j: int) -> bool:
        alike = np.isclose(tau[i], tau[j], atol=0)
        return bool(alike and _mirrored(game.agents[i], game.agents[j], turn, centre))

    def covers(k: int, m: int) -> bool:
        bodies = game.obstacles[k].shape, game.obstacles[m].shape
        same = game.obstacles[k].until == game.obstacles[m].until
        return same and _face_images(*bodies, turn, centre[: game.dim]) is not None

    agents = _permutation(range(len(game.agents)), maps)
    obstacles = None if agents is None else _permutation(range(len(game.obstacles)), covers)
    if agents is None or obstacles is None:
        return None
    return _with_encounters(objective, agents, obstacles, turn, centre[: game.dim])


def _permutation(numbers: range, maps: Callable[[int, int], bool]) -> list[int] | None:
    """Return the image of each number; None if one has no image, or several."""
    result = []
    for i in numbers:
        images = [j for j in numbers if maps(i, j)]
        if len(images) != 1:
            return None
        result.append(images[0])
    return result


def _with_encounters(
    objective: Objective,
    agents: list[int],
    obstacles: list[int],
    turn: np.ndarray,
    centre: np.ndarray,
) -> Symmetry | None:
    """Add the images of encounters and faces; None if their weights or faces do not match."""
    game = objective.game
    places = {(e.agents, e.obstacle): k for k, e in enumerate(game.encounters)}
    encounters, faces = [], []
    for k, encounter in enumerate(game.encounters):
        pair = [agents[i] for i in encounter.agents]
        obstacle = None if encounter.obstacle is None else obstacles[encounter.obstacle]
        image = places[tuple(sorted(pair)), obstacle]
        # The displacement of the image is that of its lower index from the higher one.
        sign = -1.0 if sorted(pair) != pair else 1.0
        shift = centre if encounter.obstacle is not None else np.zeros(game.dim)
        collision = game.encounters[image].collision
        mapped = _face_images(encounter.collision, collision, sign * turn, shift)
        weights = objective.encounter[k], objective.encounter[image]
        if mapped is None or not np.isclose(*weights, atol=0):
            return None
        encounters.append(image)
        faces.append(mapped)
    return Symmetry(tuple(agents), tuple(encounters), tuple(faces))


def _mirrored(agent: Agent, other: Agent, turn: np.ndarray, centre: np.ndarray) -> bool:
    """Return whether ``other`` is the image of ``agent`` under the turn about the centre."""
    d = agent.dim
    state = np.kron(np.eye(agent.state_dim // d), turn)
    inputs = np.kron(np.eye(agent.control_dim // d), turn)
    part = centre[: agent.goal.size]
    goal = state[: agent.goal.size, : agent.goal.size]
    pairs = [
        (state @ (agent.start - centre), other.start - centre),
        (agent.A @ centre, centre),  # the centre is at rest without inputs
        (state @ agent.A @ state.T, other.A),
        (state @ agent.B @ inputs.T, other.B),
        (inputs @ agent.gain @ state.T, other.gain),
        (state @ agent.noise @ state.T, other.noise),
        (state @ agent.sigma0 @ state.T, other.sigma0),
    ]
    weights = [(a.goal.size, a.lam, a.reserve, a.effort) for a in (agent, other)]
    if weights[0] != weights[1]:
        return False
    pairs.append((goal @ (agent.goal - part), other.goal - part))
    return (
        all(np.allclose(image, value, rtol=0, atol=tol.SYMMETRY) for image, value in pairs)
        and _face_images(agent.shape, other.shape, turn, np.zeros(d)) is not None
        and _same_controls(agent, other, inputs)
    )


def _same_controls(agent: Agent, other: Agent, turn: np.ndarray) -> bool:
    """Return whether the turn maps the control sets of ``agent`` to those of ``other``."""
    sets, images = pieces(agent.control), pieces(other.control)
    return [first for first, _ in sets] == [first for first, _ in images] and all(
        _face_images(control, image, turn, np.zeros(control.dim)) is not None
        for (_, control), (_, image) in zip(sets, images, strict=True)
    )


def _face_images(
    body: Polytope, other: Polytope, turn: np.ndarray, centre: np.ndarray
) -> tuple[int, ...] | None:
    """Return the images of the faces of ``body`` if the turn maps it to ``other``."""
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
