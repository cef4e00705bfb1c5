r"""The same game in its own units, about its own centre.

    x = D y + c,     u = U v

with the units of states on the diagonal of D and U that of the controls
(:mod:`ppg_env.game.units`), and c the first start where the game is far from its origin.
Arrivals, costs, margins and probabilities are those of the user's game.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.input_sets import Controls
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.plan import Plan, Profile, make_plan
from ppg_env.game.polytope import Polytope
from ppg_env.game.units import unit_of_control, units_of_state
from ppg_env.support.frozen import frozen_array

FAR = 1e4
"""Distance of the starts from the origin, in units of the bodies, from which the game is moved."""


@dataclass(frozen=True)
class Frame:
    """A game, the same game in its own units, and the map between the two.

    Attributes
    ----------
    game, canonical : the user's game, and the same game in its own units.
    states : per agent, (n,) the units of its state.
    controls : per agent, the unit of its controls.
    centre : (d,) origin of the canonical game.
    """

    game: Game
    canonical: Game
    states: tuple[np.ndarray, ...]
    controls: tuple[float, ...]
    centre: np.ndarray

    def into(self, profile: Profile) -> Profile:
        """Return a profile of the user's game as one of the canonical game, means as they are."""
        return tuple(
            Plan(
                frozen_array(plan.controls / self.controls[i]),
                frozen_array((plan.means - self._shift(i)) / self.states[i]),
                plan.arrival,
            )
            for i, plan in enumerate(profile)
        )

    def back(self, profile: Profile) -> Profile:
        """Return the plans that the controls of a canonical profile make in the user's game."""
        plans = zip(profile, self.controls, self.game.agents, strict=True)
        return tuple(make_plan(agent, plan.controls * unit) for plan, unit, agent in plans)

    def _shift(self, i: int) -> np.ndarray:
        shift = np.zeros(len(self.states[i]))
        shift[: len(self.centre)] = self.centre
        return shift


@lru_cache(maxsize=256)
def frame_of(game: Game) -> Frame | None:
    """Return the frame of a game; None if it is in its own units and near its origin already."""
    length, centre = game.unit, _centre(game)
    states = [units_of_state(agent.A, agent.dim, length) for agent in game.agents]
    controls = tuple(
        unit_of_control(agent.B, units) for agent, units in zip(game.agents, states, strict=True)
    )
    plain = all((units == 1).all() for units in states) and set(controls) == {1.0}
    if plain and not centre.any():
        return None
    agents = [
        _agent(agent, units, control, centre)
        for agent, units, control in zip(game.agents, states, controls, strict=True)
    ]
    obstacles = [_obstacle(obstacle, length, centre) for obstacle in game.obstacles]
    canonical = replace(game, agents=tuple(agents), obstacles=tuple(obstacles))
    return Frame(game, canonical, tuple(states), controls, centre)


def in_own_units(game: Game, profile: Profile) -> tuple[Game, Profile]:
    """Return the canonical game and profile, for what is a probability or a count of crashes."""
    frame = frame_of(game)
    return (game, profile) if frame is None else (frame.canonical, frame.into(profile))


@lru_cache(maxsize=1024)
def canonical_agent(agent: Agent) -> tuple[Agent, float]:
    """Return an agent in its own units, about its start, and the unit of its controls."""
    units, control = agent.state_units, agent.control_unit
    centre = _at_rest([agent], agent.start[: agent.dim], agent.unit)
    if (units == 1).all() and control == 1 and not centre.any():
        return agent, 1.0
    return _agent(agent, units, control, centre), control


def _centre(game: Game) -> np.ndarray:
    return _at_rest(game.agents, game.agents[0].start[: game.dim], game.unit)


def _at_rest(
    agents: tuple[Agent, ...] | list[Agent], point: np.ndarray, length: float
) -> np.ndarray:
    """Return ``point`` (d,) if it is far away and at rest without controls, else the origin."""
    if np.abs(point).max() <= FAR * length:
        return np.zeros_like(point)
    for agent in agents:
        state = np.zeros(agent.state_dim)
        state[: len(point)] = point
        if not np.array_equal(agent.A @ state, state):
            return np.zeros_like(point)
    return point


def _agent(agent: Agent, units: np.ndarray, control: float, centre: np.ndarray) -> Agent:
    shift = np.zeros(agent.state_dim)
    shift[: agent.dim] = centre
    return _with_fields(
        agent,
        start=(agent.start - shift) / units,
        goal=(agent.goal - shift[: agent.goal.size]) / units[: agent.goal.size],
        shape=_scaled(agent.shape, units[0]),
        control=_controls(agent.control, control),
        gain=agent.gain * units / control,
        noise=agent.noise / np.outer(units, units),
        A=agent.A * units / units[:, None],
        B=agent.B * control / units[:, None],
        sigma0=agent.sigma0 / np.outer(units, units),
        within=tuple(_region(region, units, shift) for region in agent.within),
        effort=agent.effort * control,
    )


def _with_fields(agent: Agent, **changes: Any) -> Agent:
    """Return a copy with fields replaced that need no checks, and no warning a second time."""
    copy = object.__new__(Agent)
    for field in fields(Agent):
        value = changes.get(field.name, getattr(agent, field.name))
        value = frozen_array(value) if isinstance(value, np.ndarray) else value
        object.__setattr__(copy, field.name, value)
    return copy


def _controls(controls: Controls, unit: float) -> Controls:
    if isinstance(controls, Polytope):
        return _scaled(controls, unit)
    return tuple((first, _scaled(admissible, unit)) for first, admissible in controls)


def _region(region: HalfSpaces, units: np.ndarray, shift: np.ndarray) -> HalfSpaces:
    k = region.dim
    offsets = region.offsets - region.normals @ shift[:k]
    return HalfSpaces(region.normals * units[:k], offsets, region.sigmas)


def _obstacle(obstacle: Obstacle, unit: float, centre: np.ndarray) -> Obstacle:
    noise = obstacle.noise / unit**2
    if obstacle.path is None:
        return Obstacle(_scaled(obstacle.shape, unit, centre), None, noise, obstacle.until)
    path = (obstacle.path - centre) / unit
    return Obstacle(_scaled(obstacle.shape, unit), path, noise, obstacle.until)


def _scaled(polytope: Polytope, unit: float, centre: np.ndarray | None = None) -> Polytope:
    """Return the polytope (x - centre) / unit, of the same kind where it is not moved."""
    if centre is not None and centre.any():
        return Polytope("vertices", ((polytope.vertices - centre) / unit,))
    if polytope.kind == "halfspaces":
        return Polytope(polytope.kind, (polytope.params[0], polytope.params[1] / unit))
    return Polytope(polytope.kind, (polytope.params[0] / unit, *polytope.params[1:]))
