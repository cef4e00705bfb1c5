"""The tables of crashes of a game: between its two agents, and of each with obstacles."""

from __future__ import annotations

from collections.abc import Sequence

from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from solvers.feedback.grid.event_table import (
    Events,
    fixed_hazard,
    instant_events,
    no_events,
    swept_events,
)
from solvers.feedback.grid.frozen_bodies import FrozenBody, epochs, frozen_bodies
from solvers.feedback.grid.moves import longest_move
from solvers.feedback.grid.state_grid import Grid

Harms = tuple[tuple[Events, Events], ...]
"""Per epoch and agent, the probabilities of a crash with obstacles in a step."""


def overlaps(game: Game, rules: Rules, grids: tuple[Grid, Grid]) -> Events:
    """Return the probabilities of overlaps, over displacements of agent 0 from agent 1."""
    d, (first, second) = game.dim, game.agents
    covariance = (first.noise + second.noise)[:d, :d]
    hazards = [fixed_hazard(game.encounters[0].collision)]
    if game.collisions == "instants":
        return _with(rules, instant_events(hazards, covariance))
    reach = longest_move(first, grids[0])[:d] + longest_move(second, grids[1])[:d]
    anchor = (grids[0].low - grids[1].low)[:d]
    return _with(rules, swept_events(hazards, covariance, grids[0].step[:d], anchor, reach))


def _with(rules: Rules, events: Events) -> Events:
    return events._replace(removes=rules.on_crash == "remove", parks=rules.on_goal == "stay")


def harms(game: Game, rules: Rules, grids: tuple[Grid, Grid]) -> Harms:
    """Return the probabilities of crashes with obstacles; the last epoch holds without end."""
    bodies = [frozen_bodies(game, i, {}) for i in range(2)]
    return tuple(
        (
            harm_of(game, rules, 0, clock, grids[0], bodies[0]),
            harm_of(game, rules, 1, clock, grids[1], bodies[1]),
        )
        for clock in range(epochs(bodies[0], rules.steps(game)))
    )


def harm_of(
    game: Game, rules: Rules, agent: int, clock: int, grid: Grid, bodies: Sequence[FrozenBody]
) -> Events:
    """Return the probabilities of crashes of ``agent`` with ``bodies`` in the step from ``clock``.

    The first axes of ``grid`` are positions.
    """
    d, swept = game.dim, game.collisions == "swept"
    hazards = [body.hazard(clock, swept=swept) for body in bodies]
    present = [hazard for hazard in hazards if hazard is not None]
    if not present:
        return _with(rules, no_events())
    noise = game.agents[agent].noise[:d, :d]
    if not swept:
        return _with(rules, instant_events(present, noise))
    reach = longest_move(game.agents[agent], grid)[:d]
    events = swept_events(present, noise, grid.step[:d], grid.low[:d], reach)
    return _with(rules, events)
