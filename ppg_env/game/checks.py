"""What a game refuses at the door: bodies, goals and workspaces that do not fit each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, placed, require
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import check_growth
from ppg_env.game.encounter import Encounter
from ppg_env.game.input_sets import pieces
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import lengths_per_unit


def check_agents(agents: Sequence[Agent], horizon: int) -> None:
    """Refuse agents outside their workspaces, without controls, or too large for arithmetic.

    They start or end outside, or the reserve leaves no control, or errors outgrow doubles.

    Raises
    ------
    InputError
        If there is one.
    """
    for i, agent in enumerate(agents):
        with placed(f"agent[{i}]"):
            check_scales(agent)
            check_growth(agent, horizon)
            planned_controls(agent, horizon)  # raises if the reserve leaves none
            _check_workspace(agent)


def check_encounters(
    agents: Sequence[Agent],
    obstacles: Sequence[Obstacle],
    encounters: Sequence[Encounter],
    on_goal: str,
) -> None:
    """Refuse bodies that overlap at time 0, goals inside obstacles, and parked bodies that overlap.

    Raises
    ------
    InputError
        If there are any.
    """
    pairs = [encounter for encounter in encounters if encounter.obstacle is None]
    for encounter in _near(agents, pairs):
        _check_start(agents, encounter, None)
        if on_goal == "stay":
            _check_parked(agents, encounter)
    for encounter in encounters[len(pairs) :]:
        obstacle = obstacles[encounter.obstacle or 0]
        _check_start(agents, encounter, obstacle)
        if obstacle.until is None and (obstacle.path is None or on_goal == "stay"):
            _check_goal(agents, encounter, obstacle)


def _near(agents: Sequence[Agent], pairs: Sequence[Encounter]) -> Iterator[Encounter]:
    """Yield the pairs that may overlap at their starts or goals, by the size of their bodies."""
    if not pairs:
        return
    index = np.array([pair.agents for pair in pairs])
    sets = {id(pair.collision): pair.collision for pair in pairs}
    sizes = {key: np.abs(collision.bounds).max() for key, collision in sets.items()}
    reach = 2 * np.array([sizes[id(pair.collision)] for pair in pairs])
    near = np.zeros(len(pairs), dtype=bool)
    for point in ("start", "goal"):
        places = np.array([getattr(agent, point)[: agent.dim] for agent in agents])
        near |= (np.abs(places[index[:, 0]] - places[index[:, 1]]).max(axis=1)) <= reach
    for e in np.flatnonzero(near):
        yield pairs[int(e)]


def check_scales(agent: Agent) -> None:
    """Refuse numbers that the agent's units make too large or too small for double arithmetic.

    Raises
    ------
    InputError
        If there are any.
    """
    for place, point in (("start", agent.start), ("goal", agent.goal)):
        far = float((np.abs(point) / agent.state_units[: point.size]).max())
        _require_near(far, place, "choose an origin that is nearer, or larger bodies")
    sets = pieces(agent.control)
    for k, (_, admissible) in enumerate(sets):
        place = f"control[{k}]" if len(sets) > 1 else "control"
        size = float(np.abs(admissible.bounds).max()) / agent.control_unit
        _require_near(size, place, "choose smaller controls, or larger bodies")
        require(
            size == 0 or size >= tol.NARROWEST,
            place,
            f"has the size {size:.4g} in units of the body, too small for double arithmetic",
            f"choose larger controls or smaller bodies, {tol.NARROWEST:g} at least",
        )
    for place, spread in (("noise", agent.noise), ("sigma0", agent.sigma0)):
        deviation = float((np.sqrt(np.abs(np.diag(spread))) / agent.state_units).max())
        _require_near(deviation, place, "choose a smaller covariance, or larger bodies")
        require(
            deviation == 0 or deviation >= tol.LENGTH,
            place,
            f"has variances of at most {deviation**2:.4g} in units of the body, too small for "
            "double arithmetic",
            f"write 0, or variances of which one is at least {tol.LENGTH**2:g}",
        )


def _require_near(size: float, place: str, remedy: str) -> None:
    require(
        size <= tol.FARTHEST,
        place,
        f"has the size {size:.4g} in units of the body, too large for double arithmetic",
        remedy,
    )


def _check_workspace(agent: Agent) -> None:
    for region in agent.within:
        for key, point in (("start", agent.start), ("goal", agent.goal)):
            if region.dim > point.size:  # a goal of positions does not fix the velocities
                continue
            excess = region.normals @ point[: region.dim] - region.offsets
            beyond = float((excess / lengths_per_unit(agent, region.normals)).max())
            require(
                beyond <= tol.LENGTH * agent.unit,
                key,
                f"is outside the workspace (within) by {beyond:.4g}",
                "move it inside, or widen the workspace",
            )


def _check_start(agents: Sequence[Agent], encounter: Encounter, obstacle: Obstacle | None) -> None:
    starts = [agents[k].start for k in encounter.agents]
    gap = _gap(encounter, starts, None if obstacle is None else obstacle.positions(0)[0])
    if gap < -tol.LENGTH * min(agents[k].unit for k in encounter.agents):
        first, other = encounter.places
        other += ".start" if obstacle is None else ""
        raise InputError(
            f"{first}.start", f"overlaps {other} at time 0 by {-gap:.4g}", "move one of them away"
        )


def _check_goal(agents: Sequence[Agent], encounter: Encounter, obstacle: Obstacle) -> None:
    """Refuse a goal at which an agent overlaps an obstacle that never leaves it."""
    (i,) = encounter.agents
    gap = _gap(encounter, [agents[i].goal], obstacle.positions(obstacle.rest)[-1])
    if gap < -tol.LENGTH * min(agents[k].unit for k in encounter.agents):
        first, other = encounter.places
        raise InputError(
            f"{first}.goal",
            f"lies {-gap:.4g} deep inside {other}, so {_name(agents, i)} can never stand there",
            "move the goal or the obstacle",
        )


def _check_parked(agents: Sequence[Agent], encounter: Encounter) -> None:
    i, j = encounter.agents
    gap = _gap(encounter, [agents[i].goal, agents[j].goal], None)
    if gap < -tol.LENGTH * min(agents[k].unit for k in encounter.agents):
        raise InputError(
            f"agent[{j}].goal",
            f"parks {_name(agents, j)} on {_name(agents, i)}, {-gap:.4g} deep, "
            "where bodies stay at their goals",
            'move one goal, or write on_goal = "remove"',
        )


def _gap(encounter: Encounter, points: Sequence[np.ndarray], obstacle: np.ndarray | None) -> float:
    """Return the clearance of the bodies at ``points``, and of the obstacle at its position."""
    where = encounter.displacement(*(point[: encounter.collision.dim] for point in points))
    return float(encounter.collision.clearance(where if obstacle is None else where - obstacle))


def _name(agents: Sequence[Agent], i: int) -> str:
    return agents[i].name or f"agent_{i}"
