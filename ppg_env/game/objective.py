r"""Losses of margins, and the weights of the objectives.

With s the margin of an encounter at a time in traffic and M' its cap, the loss is

    margin :  M' - s                          (the shifted safety cost of the paper's -s)
    risk   :  kappa g(s),  g(s) = (1 - erf s)/2   (kappa = ``crash_cost``)

and every objective is a weighted sum of arrivals and losses,

    sum_i  tau_i T_i  +  sum_e  omega_e  sum_t loss_e(t),

e running over ``game.encounters``.  Only the weights differ:

    selfish i   tau_i = lam_i            omega_e = 1 - lam_i          for the encounters of i
    social      tau_i = lam_i            omega_e = sum of 1 - lam_j   over the agents j of e
    potential   tau_i = lam_i/(1-lam_i)  omega_e = 1

Other rules that assign the losses of an encounter to its agents are in :mod:`solvers.liability`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.game.game import Game


@dataclass(frozen=True)
class Weights:
    """Weights of one objective.

    Attributes
    ----------
    time : (N,) cost of one step of each agent's time, tau.
    encounter : (E,) weight of each encounter's losses, omega.
    """

    time: np.ndarray
    encounter: np.ndarray


def crash_risk(margin: np.ndarray) -> np.ndarray:
    """Return g(s) = (1 - erf s)/2, the probability that a standard normal exceeds sqrt(2) s."""
    from scipy.special import erfc

    return erfc(margin) / 2


def loss(game: Game, margins: np.ndarray) -> np.ndarray:
    """Return the loss of each margin s <= M' of an encounter in traffic, in the same shape."""
    if game.objective == "margin":
        return game.margin_cap - margins
    return game.crash_cost * crash_risk(margins)


def loss_slope(game: Game, margins: np.ndarray) -> np.ndarray:
    """Return the derivative of :func:`loss`, whose tangents at s >= 0 bound it from below."""
    if game.objective == "margin":
        return np.full_like(margins, -1.0)
    return -game.crash_cost * np.exp(-(margins**2)) / np.sqrt(np.pi)


def _care(game: Game) -> np.ndarray:
    """Return the sum (E,) of 1 - lam over the agents of each encounter."""
    return np.array([sum(1 - game.agents[i].lam for i in e.agents) for e in game.encounters])


def _lams(game: Game) -> np.ndarray:
    return np.array([agent.lam for agent in game.agents])


def selfish(game: Game, agent: int) -> Weights:
    """Return the weights of the agent's own cost J_i."""
    involved = np.array([agent in e.agents for e in game.encounters], dtype=bool)
    own = np.arange(len(game.agents)) == agent
    return Weights(_lams(game) * own, (1 - game.agents[agent].lam) * involved)


def social(game: Game) -> Weights:
    """Return the weights of the sum of all costs: each pair's losses count for both agents."""
    return Weights(_lams(game), _care(game))


def potential(game: Game) -> Weights:
    """Return the weights of the exact potential Phi: J_i changes by 1 - lam_i times its change."""
    lams = _lams(game)
    return Weights(lams / (1 - lams), np.ones(len(game.encounters)))
