r"""Losses of margins, and the objectives that weigh them.

With s the margin of an encounter at a time in traffic and M' its cap, the loss is

    margin :  M' - s                          (the shifted safety cost of the paper's -s)
    risk   :  kappa g(s),  g(s) = (1 - erf s)/2   (kappa = ``crash_cost``)

Where bodies must keep apart between the steps too, s is the margin m of a step.  A touch during
the step needs the best face violated at one of its two ends, so the loss is 2 kappa g(m) there.

Every objective is a weighted sum of arrival times, losses and efforts,

    sum_i  tau_i T_i  +  sum_e  omega_e  sum_t loss_e(t)  +  sum_i  eta_i  sum_t |u_it|_1,

where e runs over ``game.encounters``.  Objectives differ in their weights, with w = ``effort``:

    selfish i   tau_i = lam_i            omega_e = 1 - lam_i            eta_i = w_i
                                         for the encounters of i
    social      tau_i = lam_i            omega_e = sum of 1 - lam_j     eta_i = w_i
                                         over the agents j of e
    potential   tau_i = lam_i/(1-lam_i)  omega_e = 1                    eta_i = w_i/(1-lam_i)

:mod:`solvers.liability` has the objectives of other liability rules.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.margins import membership
from ppg_env.support.frozen import Record, frozen_array


@dataclass(frozen=True, eq=False)
class Objective(Record):
    """A weighted sum of the arrival times, encounter losses and efforts of one game.

    Attributes
    ----------
    game : the game whose times and losses are weighted.
    time : (N,) cost of one step of each agent's time, tau.
    encounter : (E,) weight of each encounter's losses, omega.
    effort : (N,) weight of each agent's sum of |u_t|_1, eta.
    """

    game: Game
    time: np.ndarray
    encounter: np.ndarray
    effort: np.ndarray

    def __post_init__(self) -> None:
        for name in ("time", "encounter", "effort"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))


def crash_risk(margin: np.ndarray) -> np.ndarray:
    """Return g(s) = (1 - erf s)/2, the probability that a standard normal exceeds sqrt(2) s."""
    from scipy.special import erfc

    return erfc(margin) / 2


def loss(game: Game, margins: np.ndarray) -> np.ndarray:
    """Return the loss of each margin s <= M' of an event in traffic, in the same shape."""
    if game.objective == "margin":
        return game.margin_cap - margins
    return game.crash_cost * event_risk(game, margins)


def event_risk(game: Game, margins: np.ndarray) -> np.ndarray:
    """Return a bound on the crash probability of each event: g(s), and 2 g(m) for steps."""
    return crash_risk(margins) * (1 if game.collisions == "instants" else 2)


def loss_slope(game: Game, margins: np.ndarray) -> np.ndarray:
    """Return the derivative of :func:`loss`, which is convex for s >= 0.

    Tangents of the loss are therefore lower bounds of it.
    """
    if game.objective == "margin":
        return np.full_like(margins, -1.0)
    ends = 1 if game.collisions == "instants" else 2
    return -ends * game.crash_cost * np.exp(-(margins**2)) / np.sqrt(np.pi)


def _care(game: Game) -> np.ndarray:
    """Return (E,) the sum of 1 - lam over the agents of each encounter."""
    return np.array([sum(1 - game.agents[i].lam for i in e.agents) for e in game.encounters])


def _lams(game: Game) -> np.ndarray:
    return np.array([agent.lam for agent in game.agents])


def efforts(game: Game) -> np.ndarray:
    """Return (N,) the agents' costs of effort, w."""
    return np.array([agent.effort for agent in game.agents])


@lru_cache(maxsize=1024)
def selfish(game: Game, agent: int) -> Objective:
    """Return the agent's own cost J_i."""
    own = np.arange(len(game.agents)) == agent
    care = 1 - game.agents[agent].lam
    return Objective(game, _lams(game) * own, care * membership(game)[agent], efforts(game) * own)


def social(game: Game) -> Objective:
    """Return the sum of all agents' costs: the losses of a pair count for both agents."""
    return Objective(game, _lams(game), _care(game), efforts(game))


@lru_cache(maxsize=128)
def potential(game: Game) -> Objective:
    """Return the exact (weighted) potential Phi: J_i changes by (1 - lam_i) times its change."""
    lams = _lams(game)
    return Objective(
        game, lams / (1 - lams), np.ones(len(game.encounters)), efforts(game) / (1 - lams)
    )
