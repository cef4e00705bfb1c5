"""The compiled inner loop: one step of many copies of a game.

The single environment and the batched simulator both run this loop.  Noise is an argument, so
that the two can be compared draw by draw.  Each phase of a step is a function over a block of
copies, whose arrays stay in the processor's cache until the last phase.  The phases take plain
arrays, because passing a tuple of forty arrays between compiled functions costs more than the
work inside.  Numba compiles at first use and keeps the machine code on disk.

Dimensions are passed as tuples of that length (``state_axes`` of n zeros, and so on): the length
of a tuple is part of its type, so the compiler unrolls the loops over components.

Arrays: ``state`` (C, bodies, n), of the agents and then of the moving obstacles; ``before``
likewise, before the move (with swept collisions); ``status`` (C, N) with the codes of
:mod:`ppg_env.env.status`; ``parked`` (C, N) times of arrival; ``clock`` (C,); ``lam`` (C, N);
``g`` holds the game and its rules (:class:`ppg_env.env.arrays.Tables`, linked by
:mod:`ppg_env.env.table_struct`).  Starts, goals and noise are the same in all copies, N rows, or
one's own in each, C N rows.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.broad_phase import sweep
from ppg_env.env.encounters import collide, price_margins
from ppg_env.env.life_cycle import restart, settle
from ppg_env.env.movement import (
    ROWS,
    component_rows,
    move_apart,
    move_coupled,
    move_obstacles,
)
from ppg_env.env.observation import write_observations, write_obstacles
from ppg_env.env.table_struct import link
from ppg_env.support.compilation import njit
from ppg_env.tolerances import LARGEST

__all__ = ["all_usable", "begin", "link", "step"]

_write_observations = njit(cache=True)(write_observations)
_write_obstacles = njit(cache=True)(write_obstacles)

YES, NO, START = np.bool_(True), np.bool_(False), np.int64(0)
"""Literals have types of their own, for which a function that is called is compiled again: only
``price_margins``, which is faster so."""

BLOCK = 256
"""Copies that go through all phases of a step before the next ones do."""


@njit(inline="always")
def _observe(g, first, last, marks, marked, state, status, clock, out):
    """Write the observations of the copies whose mark is ``marked``."""
    _write_observations(g.goal.shape[0] > status.shape[1], first, last, g.state_axes, g.axes, marks,
                        marked, state, status, clock, g.goal, g.agent_codes[0], g.centre, g.scale,
                        g.max_cycles, g.stay, out)  # fmt: skip
    if g.path.size:
        _write_obstacles(first, last, g.axes, marks, marked, state, clock, g.path,
                         g.obstacle_times, g.scale, out)  # fmt: skip


@njit(inline="always")
def _copy(values, out):
    """Copy by a loop: an assignment has the compiler make the sentences of its errors, too."""
    for k in range(values.size):
        out[k] = values[k]


@njit(cache=True)
def all_usable(action):
    """Return whether all entries are numbers of at most ``LARGEST`` in size, hence finite."""
    usable, flat = True, action.reshape(-1)
    for k in range(flat.size):  # without a branch, so that the compiler uses vectors
        usable &= abs(flat[k]) <= LARGEST
    return usable


@njit(cache=True)
def step(
    g, state, before, status, parked, alive, clock, lam, action, noise, restarting, start_noise,
    reward, time_cost, safety_cost, arrived, crashed, overlap, terminated, truncated, acting, over,
    observation, final_observation,
):  # fmt: skip
    """Step every copy; with ``restarting``, start the next episode where one is over.

    ``terminated`` and ``alive`` follow the life-cycle of the rules.  Agents at the time limit are
    ``truncated`` and no longer alive; ``over`` marks copies whose episode has ended.
    """
    _copy(alive.reshape(-1), acting.reshape(-1))
    if g.swept:
        _copy(state.reshape(-1), before.reshape(-1))
    varied, apart = g.goal.shape[0] > status.shape[1], g.agent_codes[2].all()
    rows = np.empty((ROWS, min(BLOCK, clock.size) * status.shape[1] * len(g.state_axes)))
    for first in range(0, clock.size, BLOCK):
        last = min(first + BLOCK, clock.size)
        if g.margin_reward and not g.swept:
            price_margins(first, last, g.axes, state, state, status, arrived, parked, clock, False,
                          g.stay, g.obstacle_times, lam, g.margin_cap, g.pair, g.normals,
                          g.offsets, g.units, safety_cost)  # fmt: skip
        if apart:
            if first == 0 or varied or g.control_set.shape[0] > 1:
                component_rows(varied, first, last, g.state_axes, clock, g.A, g.B, g.root,
                               g.control_set, g.projection, g.limits, g.goal, g.agent_codes[0],
                               g.tolerance, rows)  # fmt: skip
            move_apart(first, last, g.state_axes, rows, state, status, parked, clock, action, noise,
                       g.agent_codes[1], g.scheduled, lam, g.effort, arrived,
                       time_cost)  # fmt: skip
        else:
            move_coupled(varied, first, last, g.state_axes, g.input_axes, state, status, parked,
                         clock, action, noise, g.A, g.B, g.root, g.control_set, g.projection,
                         g.limits, g.edges, g.input_normals, g.input_offsets, g.first_row, g.goal,
                         g.agent_codes, g.tolerance, g.scheduled, lam, g.effort, arrived,
                         time_cost)  # fmt: skip
        if g.obstacle_times.size:
            move_obstacles(first, last, g.state_axes, state, status.shape[1], clock, noise, g.path,
                           g.obstacle_times, g.root, g.drifting)  # fmt: skip
        if g.margin_reward and g.swept:
            price_margins(first, last, g.axes, before, state, status, arrived, parked, clock, True,
                          g.stay, g.obstacle_times, lam, g.margin_cap, g.pair, g.normals,
                          g.offsets, g.units, safety_cost)  # fmt: skip
        if g.sorting:
            sweep(first, last, g.axes, before, state, status, arrived, clock, g.swept, g.stay,
                  g.obstacle_times, g.pair, g.own_faces, g.normals, g.depths, g.extents, crashed,
                  overlap)  # fmt: skip
        else:
            collide(first, last, g.axes, before, state, status, arrived, clock, g.swept, g.stay,
                    g.obstacle_times, g.pair, g.own_faces, g.normals, g.depths, g.extents, crashed,
                    overlap)  # fmt: skip
        settle(first, last, status, alive, clock, arrived, crashed, lam, g.crash_cost,
               g.margin_reward, g.remove_crashed, g.swept, g.stay, g.last_motion, g.social,
               g.max_cycles, time_cost, safety_cost, reward, terminated, truncated,
               over)  # fmt: skip
        _observe(g, first, last, over, NO, state, status, clock, observation)
        if over[first:last].any():
            _observe(g, first, last, over, YES, state, status, clock,
                     final_observation if restarting else observation)  # fmt: skip
            if restarting:
                _begin(g, first, last, over, state, status, parked, alive, clock, start_noise,
                       observation)  # fmt: skip


@njit(cache=True)
def begin(g, chosen, state, status, parked, alive, clock, noise, observation):
    """Reset the ``chosen`` copies; ``noise`` (C, bodies, n) is read if starts are random."""
    _begin(g, START, clock.size, chosen, state, status, parked, alive, clock, noise, observation)


@njit(inline="always")
def _begin(g, first, last, chosen, state, status, parked, alive, clock, noise, observation):
    restart(g.state_axes, first, last, chosen, state, status, parked, alive, clock, noise,
            g.playing, g.start, g.start_root, g.random_start, g.goal, g.agent_codes, g.tolerance,
            g.scheduled, g.path)  # fmt: skip
    _observe(g, first, last, chosen, YES, state, status, clock, observation)
