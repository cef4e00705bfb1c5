"""First profiles of best-response dynamics: straight, sequential, waiting or given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ppg_env.errors import require
from ppg_env.game.barriers import starts_at_goal
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.margins import encounter_units
from ppg_env.game.plan import Plan, Profile, make_profile
from ppg_env.game.step_lengths import position_box
from ppg_env.support.frozen import frozen_array
from solvers.liability import Liability

STARTS = ("straight", "sequential")

WAITING = "waiting"
"""Start in which agents enter one after the other, and stand at their starts until then."""

MOST_STRAIGHT = 5
"""With more agents than this the first profile is sequential."""

RANDOM_ORDERS = 2
"""Number of random orders in which the agents enter, after the order of the game and its reverse.
"""

FAR = 1e4
"""Distance of an absent agent, in sizes of the game."""


@dataclass(frozen=True)
class Entry:
    """A start, and the order in which agents without a plan enter; None for that of the updates."""

    start: str | Profile
    order: tuple[int, ...] | None = None


def default_entries(rule: Liability, seed: int) -> Iterator[Entry]:
    """Yield the starts to try in turn, until one lets all agents find a plan.

    Straight lines of many agents all cross at once.  With right of way, an agent must not be
    held up by one that yields to it, so that there is one order.
    """
    size = len(rule.game.agents)
    if size <= MOST_STRAIGHT and rule.priority is None:
        yield Entry("straight")
    yield Entry("sequential")
    if size == 1:
        return
    if rule.priority is not None:
        yield Entry(WAITING)
        return
    random = np.random.default_rng(seed)
    forward = tuple(range(size))
    orders = [forward, forward[::-1]]
    if size > 2:
        orders += [tuple(random.permutation(size).tolist()) for _ in range(RANDOM_ORDERS)]
    for start in ("sequential", WAITING):
        for order in orders[start == "sequential" :]:
            yield Entry(start, order)


def start_profile(rule: Liability, start: str | Profile) -> tuple[Profile, set[int]]:
    """Return the first profile and the agents in it that have no plan yet.

    Raises
    ------
    InputError
        If ``start`` is neither a known start nor a full profile.
    """
    game = rule.game
    if not isinstance(start, str):
        require(
            len(start) == len(game.agents),
            "start",
            "does not have one plan per agent",
            "give a full profile",
        )
        return make_profile(game, [plan.controls for plan in start]), set()
    known = start in STARTS or start == WAITING
    require(known, "start", f"is {start!r}", "write " + " or ".join(STARTS))
    plans: list[Plan] = []
    pending = set()
    for i, agent in enumerate(game.agents):
        fixed = start == "straight" or starts_at_goal(agent)
        plan = straight_plan(agent, game.horizon) if fixed else None
        if plan is None:
            pending.add(i)
            plan = waiting_plan(game, i) if start == WAITING else absent_plan(game, i)
        plans.append(plan)
    return tuple(plans), pending


def absent_plan(game: Game, index: int) -> Plan:
    """Return a stand-in plan that is never in traffic, for an agent without a plan.

    Where bodies stay at their goals it stands out of reach of all other agents.
    """
    agent = game.agents[index]
    means = np.tile(agent.start, (game.horizon + 1, 1))
    if game.on_goal == "stay":
        means[:, : game.dim] += FAR * _size(game)
    return _stand_in(game, index, means, 0)


def waiting_plan(game: Game, index: int) -> Plan:
    """Return a stand-in plan of an agent that stands at its start all the time."""
    return _stand_in(game, index, np.tile(game.agents[index].start, (game.horizon + 1, 1)), None)


def _stand_in(game: Game, index: int, means: np.ndarray, arrival: int | None) -> Plan:
    controls = np.zeros((game.horizon, game.agents[index].control_dim))
    return Plan(frozen_array(controls), frozen_array(means), arrival)


def _size(game: Game) -> float:
    """Return the size of the space that agents can reach, with bodies and margins."""
    reach = max(float(np.abs(position_box(a, game.horizon)).max()) for a in game.agents)
    bodies = max((float(np.abs(e.collision.bounds).max()) for e in game.encounters), default=0.0)
    unit = max((float(encounter_units(game, e).max()) for e in game.encounters), default=0.0)
    return reach + bodies + game.margin_cap * unit
