r"""Certified bounds on the crash probability of a profile that is played on its schedule.

With ``collisions="instants"``, A_e(t) is the event that encounter e overlaps at time t in traffic;
an agent crashes if any of its events happens.  Each line is an upper bound on Pr(union of A_k), and
at most the previous one:

    union      sum_k g(min(M', s_k))               the paper's, margins capped
    faces      sum_k g(s_k)                        the same, without the cap
    instants   sum_k Pr(A_k)                       exact for each instant
    tree       sum_k Pr(A_k) - sum_kl Pr(A_k, A_l) (k, l) the edges of a forest (Hunter, Worsley)

and ``least`` = max_k Pr(A_k) is a lower bound.  Forests have edges between successive times of an
encounter, and between encounters that share an agent at one time; the heaviest forest is used.
Joint probabilities that are not exact are bounded from below, so the bound still holds.

With ``collisions="swept"`` the events are overlaps during the steps in traffic, and

    union      sum_k 2 g(min(M', m_k))             what the programs minimise
    faces      the cheapest half-spaces            (:mod:`ppg_env.game.swept_bound`)
    tree       the same, less what successive half-spaces share (:mod:`ppg_env.risk.shared_tails`)

are upper bounds.  ``least`` stays a lower bound, since the instants belong to the steps.  A step
has no exact probability here, so there is no ``instants``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.special import log_ndtr, logsumexp

from ppg_env.game.canonical import in_own_units
from ppg_env.game.dynamics import covariances
from ppg_env.game.encounter import Encounter
from ppg_env.game.evaluation import Evaluation, evaluate
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_covariances, mean_displacements, membership, rests
from ppg_env.game.objective import event_risk
from ppg_env.game.plan import Profile
from ppg_env.game.swept_bound import TINY, swept_covers
from ppg_env.risk.joint_bounds import log_joint_bound
from ppg_env.risk.overlap import FLAT, log_best_face, log_overlap
from ppg_env.risk.shared_tails import log_tree_bound

WEAK = np.log(1e-5)
"""Events below this share of the likeliest are left out of forests: their effect is small."""


@dataclass(frozen=True)
class Bounds:
    """Bounds on one crash probability, all in [0, 1], as the module defines them."""

    union: float
    faces: float
    instants: float | None
    tree: float
    least: float


@dataclass(frozen=True)
class RiskBounds:
    """Bounds for a profile.  N agents, E encounters, times 0..H.

    Attributes
    ----------
    log_instants : (E, H+1) log of each Pr(A_e(t)); minus infinity out of traffic.  Swept, the ends
        of steps in traffic count as instants.
    agents : bounds for each agent, that it crashes.
    encounters : bounds for each of ``game.encounters``, that it overlaps at all.
    any : bounds for the event that any agent crashes.
    """

    log_instants: np.ndarray
    agents: tuple[Bounds, ...]
    encounters: tuple[Bounds, ...]
    any: Bounds

    @property
    def instants(self) -> np.ndarray:
        """(E, H+1) each Pr(A_e(t)); at least the smallest float unless it is zero."""
        floor = np.where(np.isneginf(self.log_instants), 0.0, TINY)
        return np.maximum(np.exp(self.log_instants), floor)


@dataclass(frozen=True)
class _Events:
    """Log probabilities (E, H+1), and edges between flattened events with log joint bounds."""

    union: np.ndarray
    faces: np.ndarray
    instants: np.ndarray
    first: np.ndarray
    second: np.ndarray
    joint: np.ndarray


def risk_bounds(game: Game, profile: Profile) -> RiskBounds:
    """Return bounds on the crash probabilities of the game's own event, as the module defines them.

    Raises
    ------
    InputError
        If the profile does not fit the game, or in more than three dimensions with sets or noise
        that are not along the axes.
    """
    if game.scale != "exact":
        game = replace(game, scale="exact")
    game, profile = in_own_units(game, profile)
    judged, places = evaluate(game, profile), mean_displacements(game, profile)
    frozen = [rests(game, e, judged.arrival) for e in game.encounters]
    spreads = [
        encounter_covariances(game, *pair) for pair in zip(game.encounters, frozen, strict=True)
    ]
    traffic = judged.traffic.copy()
    if game.collisions == "swept":  # the end of a step counts
        traffic[:, 1:] |= judged.traffic[:, :-1]
    faces, instants = np.full((2, *traffic.shape), -np.inf)
    for e, encounter in enumerate(game.encounters):
        data = encounter.collision, places[e][traffic[e]], spreads[e][traffic[e]]
        faces[e, traffic[e]] = log_best_face(*data)
        instants[e, traffic[e]] = log_overlap(*data)
    capped = np.maximum(faces, log_ndtr(-np.sqrt(2) * game.margin_cap))
    if game.collisions == "swept":
        return _step_bounds(judged, spreads, frozen, instants)
    edges = _edges(game, places, spreads, instants, frozen)
    events = _Events(np.where(traffic, capped, -np.inf), faces, instants, *edges)
    E = len(game.encounters)
    return RiskBounds(
        instants,
        tuple(_bounds(events, own) for own in membership(game)),
        tuple(_bounds(events, own) for own in np.eye(E, dtype=bool)),
        _bounds(events, np.ones(E, dtype=bool)),
    )


def _edges(
    game: Game,
    places: np.ndarray,
    spreads: list[np.ndarray],
    instants: np.ndarray,
    frozen: list[tuple[int, ...]],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return first and second flattened events, and log lower bounds on joint probabilities."""
    count, times = instants.shape
    noisy = np.array([_regular(spread) for spread in spreads], dtype=bool).reshape(count, times)
    top = instants.max(axis=1, keepdims=True, initial=-np.inf)
    likely = noisy & np.isfinite(instants) & (instants >= top + WEAK)
    dominant = likely & (instants >= instants.max(initial=-np.inf) + WEAK)
    jobs = [(e, e, np.flatnonzero(likely[e, :-1] & likely[e, 1:]), 1) for e in range(count)]
    for e, f in combinations(np.flatnonzero(dominant.any(axis=1)).tolist(), 2):
        if set(game.encounters[e].agents) & set(game.encounters[f].agents):
            jobs.append((e, f, np.flatnonzero(dominant[e] & dominant[f]), 0))
    edges = [(np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0))]
    for e, f, at, lag in jobs:
        if at.size:
            pair = game.encounters[e], game.encounters[f]
            joint = log_joint_bound(
                (pair[0].collision, pair[1].collision),
                (places[e][at], places[f][at + lag]),
                (spreads[e][at], spreads[f][at + lag]),
                _cross(game, *pair, lag, frozen[e])[at],
            )
            edges.append((e * times + at, f * times + at + lag, joint))
    first, second, joint = (np.concatenate(parts) for parts in zip(*edges, strict=True))
    return first, second, joint


def _cross(
    game: Game, first: Encounter, second: Encounter, lag: int, rest: tuple[int, ...]
) -> np.ndarray:
    """Return (H+1, d, d) covariances of ``first`` at t with ``second`` at t + lag.

    Errors follow e_(t+1) = (A - B gain) e_t + w_t, so cov(e_t, e_(t+1)) = Sigma_t (A - B gain)'.
    Those of the agents of ``first`` stay as they are from their ``rest`` on, and an obstacle's are
    a random walk up to its own.
    """
    total = np.zeros((game.horizon + 1, game.dim, game.dim))
    for i in set(first.agents) & set(second.agents):
        agent = game.agents[i]
        later = np.linalg.matrix_power(agent.closed_loop, lag).T
        sign = 1 if first.agents.index(i) == second.agents.index(i) else -1
        spread, last = covariances(agent, game.horizon), rest[first.agents.index(i)]
        product = spread @ later
        product[last:] = spread[last] if last < game.horizon else product[last]
        total += sign * product[:, : game.dim, : game.dim]
    if first.obstacle is not None and first.obstacle == second.obstacle:
        total += game.obstacles[first.obstacle].covariances(game.horizon)
    return total


def _step_bounds(
    judged: Evaluation,
    spreads: list[np.ndarray],
    frozen: list[tuple[int, ...]],
    instants: np.ndarray,
) -> RiskBounds:
    """Return the bounds for overlaps during steps."""
    game, covers = judged.game, swept_covers(judged.game, judged.profile)
    planned = np.where(judged.traffic, event_risk(game, judged.margins), 0.0).sum(axis=1)
    faces = np.array([_sum(cover.log_tails) for cover in covers])
    trees = np.array(
        [
            log_tree_bound(cover, spread, _cross(game, encounter, encounter, 1, rest))
            for cover, spread, encounter, rest in zip(
                covers, spreads, game.encounters, frozen, strict=True
            )
        ]
    )

    def bounds(chosen: np.ndarray) -> Bounds:
        least = float(instants[chosen].max(initial=-np.inf))
        return Bounds(
            union=min(float(planned[chosen].sum()), 1.0),
            faces=_upper(_sum(faces[chosen])),
            instants=None,
            tree=_upper(max(_sum(trees[chosen]), least)),
            least=float(min(np.exp(least), 1.0)),
        )

    E = len(game.encounters)
    return RiskBounds(
        instants,
        tuple(bounds(own) for own in membership(game)),
        tuple(bounds(own) for own in np.eye(E, dtype=bool)),
        bounds(np.ones(E, dtype=bool)),
    )


def _regular(spread: np.ndarray) -> np.ndarray:
    """Return (H+1,) whether there is noise in every direction."""
    values = np.linalg.eigvalsh(spread)
    return values[:, 0] > FLAT**2 * values[:, -1]


def _bounds(events: _Events, chosen: np.ndarray) -> Bounds:
    """Return bounds on the union of the events of the ``chosen`` (E,) encounters."""
    union, faces, instants = (
        _sum(logs[chosen]) for logs in (events.union, events.faces, events.instants)
    )
    least = float(events.instants[chosen].max(initial=-np.inf))
    tree = max(instants + np.log1p(-_forest(events, chosen, instants)), least)
    return Bounds(
        union=_upper(union),
        faces=_upper(faces),
        instants=_upper(instants),
        tree=_upper(tree),
        least=float(min(np.exp(least), 1.0)),
    )


def _forest(events: _Events, chosen: np.ndarray, total: float) -> float:
    """Return the weight of the heaviest forest, as a share of the sum of the chosen events."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    times = events.instants.shape[1]
    inside = chosen[events.first // times] & chosen[events.second // times]
    if not inside.any():
        return 0.0
    nodes = np.unique([events.first[inside], events.second[inside]])
    ends = [np.searchsorted(nodes, end[inside]) for end in (events.first, events.second)]
    weights = -np.exp(events.joint[inside] - total)
    graph = coo_array((weights, ends), shape=(nodes.size, nodes.size))
    return float(-minimum_spanning_tree(graph.tocsr()).sum())


def _sum(logs: np.ndarray) -> float:
    return float(logsumexp(logs)) if logs.size else -np.inf


def _upper(log: float) -> float:
    """Return a probability that is at least the exponential of ``log``."""
    return 0.0 if np.isneginf(log) else float(np.clip(np.exp(log), TINY, 1.0))
