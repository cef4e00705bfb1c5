r"""The one evaluator: what a profile costs, how safe it is, and whether it is a plan at all.

Everything is recomputed from the game and the controls; no solver's word is taken.

    sigma_p(t)^2 = a_p' (Sigma_i(t) + Sigma_j(t)) a_p
    s_e(t) = min(M', max_p (a_p' (r_i - r_j) - b_p) / (sqrt(2) sigma_p(t)))   in traffic, else M'
    G_i = - sum_t sum_e s_e(t)             deficit_i = sum_t sum_e (M' - s_e(t))
    J_i = lam_i T_i + (1 - lam_i) G_i      (risk: kappa sum g(s) for G_i)

A pair is in traffic at t iff t < T_i and t < T_j; an agent and an obstacle iff t < T_i.
``scale="paper"`` drops the sqrt(2), as the paper's programs do; sum g is then no bound.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError
from ppg_env.game import objective
from ppg_env.game.dynamics import goal_selector, rollout
from ppg_env.game.game import Game
from ppg_env.game.input_sets import excess
from ppg_env.game.margins import in_traffic, membership, profile_margins
from ppg_env.game.plan import Profile, make_profile


@dataclass(frozen=True)
class Residuals:
    """Violations of the constraints, never negative.

    Attributes
    ----------
    control : (N,) largest distance of a control beyond a face of its step's U.
    goal : (N,) largest component by which the mean misses the goal, at arrival or at the end.
    overlap : (E,) largest penetration of the means in traffic.
    """

    control: np.ndarray
    goal: np.ndarray
    overlap: np.ndarray


@dataclass(frozen=True)
class Evaluation:
    """What the evaluator found.  N agents, E encounters, times 0..H.

    Attributes
    ----------
    arrival : per agent, the arrival T_i; None if its mean never reaches the goal.
    margins : (E, H+1) margin s, at its cap out of traffic, in the order of ``game.encounters``.
    traffic : (E, H+1) whether the encounter is in traffic.
    safety_cost : (N,) G_i = -sum s.
    deficit : (N,) sum of M' - s.
    cost, shifted_cost : (N,) J_i, with G_i and with the deficit; infinite without arrival.
        For the objective ``risk`` both are lam T + (1 - lam) kappa sum g.
    potential : Phi of the profile.
    residuals : by how much each constraint is violated; zero is clean.
    """

    game: Game
    arrival: tuple[int | None, ...]
    margins: np.ndarray
    traffic: np.ndarray
    safety_cost: np.ndarray
    deficit: np.ndarray
    risk_sum: np.ndarray
    risk_sum_any: float
    cost: np.ndarray
    shifted_cost: np.ndarray
    potential: float
    residuals: Residuals

    @property
    def social_cost(self) -> float:
        """Sum of the agents' shifted costs."""
        return float(self.shifted_cost.sum())

    @property
    def feasible(self) -> bool:
        """Whether every constraint holds within tolerance."""
        return self.is_feasible()

    def is_feasible(self, agents: Iterable[int] | None = None) -> bool:
        """Return whether all constraints that involve ``agents`` (all by default) hold."""
        return next(self._violated(agents), None) is None

    def violations(self, agents: Iterable[int] | None = None) -> tuple[str, ...]:
        """Return a sentence for each violated constraint that involves ``agents`` (or any)."""
        return tuple(self._sentence(kind, index) for kind, index in self._violated(agents))

    def _violated(self, agents: Iterable[int] | None) -> Iterator[tuple[str, int]]:
        """Yield the kind of each violated constraint and its agent or, for overlaps, encounter."""
        chosen = set(range(len(self.arrival)) if agents is None else agents)
        for i in sorted(chosen):
            if self.residuals.control[i] > tol.CONTROL:
                yield "control", i
            if self.arrival[i] is None:
                yield "goal", i
        for e, encounter in enumerate(self.game.encounters):
            if self.residuals.overlap[e] > tol.LENGTH and chosen.intersection(encounter.agents):
                yield "overlap", e

    def _sentence(self, kind: str, index: int) -> str:
        names, residual = self.game.agent_names, getattr(self.residuals, kind)[index]
        if kind == "control":
            return f"a control of {names[index]} leaves its set by {residual:.3g}"
        if kind == "goal":
            miss = f"misses its goal by {residual:.3g} within the horizon"
            return f"the mean of {names[index]} {miss}"
        encounter = self.game.encounters[index]
        parties = [names[i] for i in encounter.agents]
        if encounter.obstacle is not None:
            parties.append(f"obstacle {encounter.obstacle}")
        return f"the means of {' and '.join(parties)} overlap by {residual:.3g}"

    @property
    def risk_bound(self) -> np.ndarray:
        """(N,) union bound on each agent's crash probability, sum of g(s) in traffic.

        Margins are capped, so an instant counts g(M') at least: that keeps the bound valid, and
        makes it loose where margins are wide (:mod:`ppg_env.risk.union_bounds` has tighter ones).

        Raises
        ------
        InputError
            For ``scale="paper"``, whose sum is not a bound (see :attr:`risk_sum`).
        """
        self._refuse_paper_scale()
        return self.risk_sum

    @property
    def risk_bound_any(self) -> float:
        """Union bound on the probability that anybody crashes."""
        self._refuse_paper_scale()
        return self.risk_sum_any

    def _refuse_paper_scale(self) -> None:
        if self.game.scale != "exact":
            raise InputError(
                "scale",
                "'paper' drops the sqrt(2), so its sum of g is no bound",
                "evaluate the game with scale = 'exact'",
            )

    def weighted(self, weights: objective.Objective) -> float:
        """Value of any objective of this game at this profile; infinite without arrival."""
        return _weighted(weights, self.arrival, self._losses)

    @property
    def _losses(self) -> np.ndarray:
        return np.where(self.traffic, objective.loss(self.game, self.margins), 0.0).sum(axis=1)


def evaluate(game: Game, profile: Profile, *, as_given: bool = False) -> Evaluation:
    """Judge ``profile`` in ``game`` from first principles; infeasible profiles are judged too.

    Means and arrivals are computed anew from the controls.  With ``as_given`` those of the plans
    are taken as they are: for predictions, and for stand-ins of agents that have no plan yet.

    Raises
    ------
    InputError
        If the profile's sizes do not fit the game.
    """
    if not as_given:
        profile = make_profile(game, [plan.controls for plan in profile])
    arrival = tuple(plan.arrival for plan in profile)
    traffic = in_traffic(game, arrival)
    margins = np.where(traffic, profile_margins(game, profile), game.margin_cap)
    losses = np.where(traffic, objective.loss(game, margins), 0.0).sum(axis=1)
    risks = np.where(traffic, objective.crash_risk(margins), 0.0).sum(axis=1)
    member = membership(game)  # (N, E)
    deficit = _sums(member, (game.margin_cap - margins).sum(axis=1))
    steps = game.horizon + 1
    best = member.sum(axis=1) * game.margin_cap * steps  # what full margins would add up to
    safety_cost = deficit - best
    shifted = np.array(
        [
            np.inf if arrival[i] is None else _weighted(objective.selfish(game, i), arrival, losses)
            for i in range(len(arrival))
        ]
    )
    shift = 0.0
    if game.objective == "margin":
        care = 1 - np.array([agent.lam for agent in game.agents])
        shift = -care * best
    return Evaluation(
        game=game,
        arrival=arrival,
        margins=margins,
        traffic=traffic,
        safety_cost=safety_cost,
        deficit=deficit,
        risk_sum=_sums(member, risks),
        risk_sum_any=float(risks.sum()),
        cost=shifted + shift,
        shifted_cost=shifted,
        potential=np.inf
        if None in arrival
        else _weighted(objective.potential(game), arrival, losses),
        residuals=_residuals(game, profile, traffic),
    )


def _weighted(
    weights: objective.Objective, arrival: tuple[int | None, ...], losses: np.ndarray
) -> float:
    mine = [i for i, tau in enumerate(weights.time) if tau > 0]
    if any(arrival[i] is None for i in mine):
        return float("inf")
    spent = sum(weights.time[i] * arrival[i] for i in mine)
    return float(spent + _sums(weights.encounter, losses))


def _sums(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """``weights`` (..., E) times ``values`` (E,), where nothing times infinity is nothing."""
    return np.where(weights > 0, weights * np.where(weights > 0, values, 0.0), 0.0).sum(axis=-1)


def _residuals(game: Game, profile: Profile, traffic: np.ndarray) -> Residuals:
    control, goal = np.zeros(len(profile)), np.zeros(len(profile))
    for i, (agent, plan) in enumerate(zip(game.agents, profile, strict=True)):
        end = game.horizon if plan.arrival is None else plan.arrival
        control[i] = max(0.0, excess(agent.control, plan.controls[:end]))
        mean = rollout(agent, plan.controls[:end])[-1]
        goal[i] = float(np.abs(goal_selector(agent) @ mean - agent.goal).max())
    means = [plan.means[:, : game.dim] for plan in profile]
    overlap = np.zeros(len(game.encounters))
    for e, encounter in enumerate(game.encounters):
        where = encounter.displacement(*(means[i] for i in encounter.agents))[traffic[e]]
        if len(where):
            overlap[e] = max(0.0, -float(encounter.collision.clearance(where).min()))
    return Residuals(control, goal, overlap)
