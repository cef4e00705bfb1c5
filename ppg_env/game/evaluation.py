r"""The evaluator: cost, safety and feasibility of a profile.

Every value is recomputed from the game and the controls; no result of a solver is used.

    sigma_p(t)^2 = a_p' (Sigma_i(t) + Sigma_j(t)) a_p
    s_e(t) = min(M', max_p (a_p' (r_i - r_j) - b_p) / (sqrt(2) sigma_p(t)))   in traffic, else M'
    G_i = - sum_t sum_e s_e(t)             deficit_i = sum_t sum_e (M' - s_e(t))
    J_i = lam_i T_i + (1 - lam_i) G_i + w_i sum_t |u_it|_1      (risk: kappa sum g(s) for G_i)

A pair is in traffic at t iff t < T_i and t < T_j (where bodies stay: or), an agent and an obstacle
iff t < T_i.  With ``collisions="swept"``, t counts steps, with their margins m(t) and 2 g(m) for
g(s) (:mod:`ppg_env.game.margins`, :mod:`ppg_env.game.objective`).
``scale="paper"`` drops the sqrt(2), as the paper's programs do; sum g is then not a bound.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError
from ppg_env.game import objective
from ppg_env.game.canonical import in_own_units
from ppg_env.game.game import Game
from ppg_env.game.margins import in_traffic, margins_and_overlaps, membership
from ppg_env.game.plan import Profile, make_profile
from ppg_env.game.residuals import Residuals, residuals
from ppg_env.game.swept_bound import swept_covers


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of a profile.  N agents, E encounters, times 0..H.

    Attributes
    ----------
    profile : the plans.
    arrival : per agent, the arrival T_i; None if its mean never reaches the goal.
    margins : (E, H+1) margin of each event, an instant or the step that starts there; at its cap
        out of traffic, in the order of ``game.encounters``.
    traffic : (E, H+1) whether the encounter is in traffic.
    safety_cost : (N,) G_i = -sum s.
    deficit : (N,) sum of M' - s.
    cost, shifted_cost : (N,) J_i, with G_i and with the deficit; infinite without arrival.
        For the objective ``risk`` both are lam T + (1 - lam) kappa sum g.
    effort : (N,) sum of ``|u_t|_1``.
    risk_sum : (N,) sum of g(s) in traffic; of 2 g(m) over steps.
    risk_sum_any : the same sum over all encounters.
    potential : Phi of the profile.
    residuals : violations of the constraints.
    """

    game: Game
    profile: Profile
    arrival: tuple[int | None, ...]
    margins: np.ndarray
    traffic: np.ndarray
    safety_cost: np.ndarray
    deficit: np.ndarray
    effort: np.ndarray
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
        """Whether every residual is within tolerance."""
        return self.is_feasible()

    def is_feasible(self, agents: Iterable[int] | None = None) -> bool:
        """Return whether all constraints that involve ``agents`` (default: all) are satisfied."""
        return next(self._violated(agents), None) is None

    def violations(self, agents: Iterable[int] | None = None) -> tuple[str, ...]:
        """Return one sentence per violated constraint that involves ``agents`` (default: all)."""
        return tuple(self._sentence(kind, k) for kind, k in self._violated(agents))

    def _violated(self, agents: Iterable[int] | None) -> Iterator[tuple[str, int]]:
        """Yield the kind of each violated constraint, with its agent or encounter."""
        chosen = set(range(len(self.arrival)) if agents is None else agents)
        for i in sorted(chosen):
            agent = self.game.agents[i]
            if self.residuals.control[i] > tol.CONTROL * agent.control_unit:
                yield "control", i
            if self.residuals.within[i] > tol.LENGTH * agent.unit:
                yield "within", i
            if self.arrival[i] is None:
                yield "goal", i
        for e, encounter in enumerate(self.game.encounters):
            deep = self.residuals.overlap[e] > tol.LENGTH * self.game.unit
            if deep and chosen.intersection(encounter.agents):
                yield "overlap", e

    def _sentence(self, kind: str, k: int) -> str:
        names, residuals = self.game.agent_names, self.residuals
        if kind == "control":
            return f"a control of {names[k]} leaves its set by {residuals.control[k]:.3g}"
        if kind == "within":
            return f"the mean of {names[k]} leaves its workspace by {residuals.within[k]:.3g}"
        if kind == "goal":
            miss = f"{residuals.goal[k]:.3g}"
            return f"the mean of {names[k]} misses its goal by {miss} within the horizon"
        encounter = self.game.encounters[k]
        parties = [names[i] for i in encounter.agents]
        if encounter.obstacle is not None:
            parties.append(f"obstacle {encounter.obstacle}")
        between = " between two steps" if self.game.collisions == "swept" else ""
        depth = f"{residuals.overlap[k]:.3g}"
        return f"the means of {' and '.join(parties)} overlap{between} by {depth}"

    @property
    def risk_bound(self) -> np.ndarray:
        """(N,) upper bound on the probability that the agent crashes, in the game's own event.

        ``collisions="instants"``: overlap at a time step in traffic; sum of g(s).  Margins are
        capped, so each time counts at least g(M'): the bound is loose where margins are wide
        (:mod:`ppg_env.risk.union_bounds` has tighter ones).

        ``"swept"``: overlap during a step; by :mod:`ppg_env.game.swept_bound`, at most the sum.

        Raises
        ------
        InputError
            For ``scale="paper"``, whose sum is not a bound (see :attr:`risk_sum`).
        """
        self._refuse_paper_scale()
        if self.game.collisions == "instants":
            return self.risk_sum
        return _sums(membership(self.game), self._swept_bounds)

    @property
    def risk_bound_any(self) -> float:
        """Upper bound on the probability that any agent crashes, as for :attr:`risk_bound`."""
        self._refuse_paper_scale()
        if self.game.collisions == "instants":
            return self.risk_sum_any
        return float(self._swept_bounds.sum())

    @cached_property
    def _swept_bounds(self) -> np.ndarray:
        covers = swept_covers(*in_own_units(self.game, self.profile))
        return np.array([cover.bound for cover in covers])

    def _refuse_paper_scale(self) -> None:
        if self.game.scale != "exact":
            raise InputError(
                "scale",
                "'paper' drops the sqrt(2), so its sum of g is not a bound",
                "evaluate the game with scale = 'exact'",
            )

    def weighted(self, weights: objective.Objective) -> float:
        """Return the value of an objective at this profile; infinite without arrival."""
        return _weighted(weights, self.arrival, self._losses, self.effort)

    @property
    def _losses(self) -> np.ndarray:
        return np.where(self.traffic, objective.loss(self.game, self.margins), 0.0).sum(axis=1)


def evaluate(game: Game, profile: Profile, *, as_given: bool = False) -> Evaluation:
    """Return the evaluation of ``profile`` in ``game``; the profile need not be feasible.

    Parameters
    ----------
    game : the game.
    profile : one plan per agent.
    as_given : use the means and arrivals of the plans instead of recomputing them from the
        controls: for predictions, and for placeholders of agents without a plan.

    Raises
    ------
    InputError
        If the profile's sizes do not fit the game.
    """
    if not as_given:
        profile = make_profile(game, [plan.controls for plan in profile])
    arrival = tuple(plan.arrival for plan in profile)
    traffic = in_traffic(game, arrival)
    all_margins, overlaps = margins_and_overlaps(game, profile)
    margins = np.where(traffic, all_margins, game.margin_cap)
    losses = np.where(traffic, objective.loss(game, margins), 0.0).sum(axis=1)
    risks = np.where(traffic, objective.event_risk(game, margins), 0.0).sum(axis=1)
    effort = np.array([np.abs(plan.controls).sum() for plan in profile])
    member = membership(game)  # (N, E)
    deficit = _sums(member, (game.margin_cap - margins).sum(axis=1))
    full = member.sum(axis=1) * game.margin_cap * margins.shape[1]  # sum of margins at the cap
    shifted = _selfish_costs(game, arrival, losses, effort)
    potential = np.inf
    if None not in arrival:
        potential = _weighted(objective.potential(game), arrival, losses, effort)
    return Evaluation(
        game=game,
        profile=profile,
        arrival=arrival,
        margins=margins,
        traffic=traffic,
        safety_cost=deficit - full,
        deficit=deficit,
        effort=effort,
        risk_sum=_sums(member, risks),
        risk_sum_any=float(risks.sum()),
        cost=shifted + _shift(game, full),
        shifted_cost=shifted,
        potential=potential,
        residuals=residuals(game, profile, overlaps),
    )


def _selfish_costs(
    game: Game, arrival: tuple[int | None, ...], losses: np.ndarray, effort: np.ndarray
) -> np.ndarray:
    costs = np.full(len(arrival), np.inf)
    for i, time in enumerate(arrival):
        if time is not None:
            costs[i] = _weighted(objective.selfish(game, i), arrival, losses, effort)
    return costs


def _shift(game: Game, full: np.ndarray) -> np.ndarray | float:
    """Return the difference of costs and shifted costs; margins at the cap sum to ``full`` (N,)."""
    if game.objective != "margin":
        return 0.0
    return -(1 - np.array([agent.lam for agent in game.agents])) * full


def _weighted(
    weights: objective.Objective,
    arrival: tuple[int | None, ...],
    losses: np.ndarray,
    effort: np.ndarray,
) -> float:
    timed = [i for i, tau in enumerate(weights.time) if tau > 0]
    if any(arrival[i] is None for i in timed):
        return float("inf")
    spent = sum(weights.time[i] * arrival[i] for i in timed)
    return float(spent + _sums(weights.encounter, losses) + _sums(weights.effort, effort))


def _sums(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return ``weights`` (..., E) times ``values`` (E,), summed, with 0 times infinity = 0."""
    return (weights * np.where(weights > 0, values, 0.0)).sum(axis=-1)
