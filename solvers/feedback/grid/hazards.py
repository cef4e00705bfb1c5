"""The tables of crashes of a game: between its two agents, and of each with obstacles."""

from __future__ import annotations

import numpy as np

from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from solvers.feedback.grid.event_table import (
    Events,
    Hazard,
    instant_events,
    no_events,
    swept_events,
)
from solvers.feedback.grid.moves import longest_move
from solvers.feedback.grid.state_grid import Grid

Harms = tuple[tuple[Events, Events], ...]
"""Per epoch and agent, the probabilities of a crash with obstacles in a step."""


def overlaps(game: Game, rules: Rules, grids: tuple[Grid, Grid]) -> Events:
    """Return the probabilities of overlaps, over displacements of agent 0 from agent 1."""
    d, (first, second) = game.dim, game.agents
    covariance, origin = (first.noise + second.noise)[:d, :d], np.zeros(d)
    hazards = [Hazard(game.encounters[0].collision, origin, origin)]
    if game.collisions == "instants":
        return _with(rules, instant_events(hazards, covariance))
    reach = longest_move(first, grids[0])[:d] + longest_move(second, grids[1])[:d]
    anchor = (grids[0].low - grids[1].low)[:d]
    return _with(rules, swept_events(hazards, covariance, grids[0].step[:d], anchor, reach))


def _with(rules: Rules, events: Events) -> Events:
    return events._replace(removes=rules.on_crash == "remove", parks=rules.on_goal == "stay")


def harms(game: Game, rules: Rules, grids: tuple[Grid, Grid]) -> Harms:
    """Return the probabilities of crashes with obstacles; the last epoch holds without end."""
    return tuple(
        (harm_of(game, rules, 0, clock, grids[0]), harm_of(game, rules, 1, clock, grids[1]))
        for clock in range(epochs(game, rules))
    )


def epochs(game: Game, rules: Rules) -> int:
    """Return the number of first steps in which obstacles differ; the last one stands for more."""
    moving = [obstacle for obstacle in game.obstacles if obstacle.path is not None]
    ends = [max(obstacle.rest, obstacle.until or 0) + 1 for obstacle in moving]
    return min(max(ends, default=1), rules.steps(game))


def harm_of(game: Game, rules: Rules, agent: int, clock: int, grid: Grid) -> Events:
    """Return the probabilities of crashes of ``agent`` in the step from ``clock``."""
    d, swept = game.dim, game.collisions == "swept"
    hazards = []
    for encounter in game.encounters:
        if encounter.obstacle is None or encounter.agents[0] != agent:
            continue
        obstacle = game.obstacles[encounter.obstacle]
        event = clock if swept else clock + 1
        if obstacle.until is None or event < obstacle.until:
            path = obstacle.positions(clock + 1)
            hazards.append(Hazard(encounter.collision, path[clock], path[clock + 1]))
    if not hazards:
        return _with(rules, no_events())
    noise = game.agents[agent].noise[:d, :d]
    if not swept:
        return _with(rules, instant_events(hazards, noise))
    reach = longest_move(game.agents[agent], grid)[:d]
    events = swept_events(hazards, noise, grid.step[:d], grid.low[:d], reach)
    return _with(rules, events)
