"""Best responses: the paper's MP1 (one agent among obstacles) and MP2 (among moving agents)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.game.barriers import starts_at_goal
from ppg_env.game.between_steps import overlap_times
from ppg_env.game.earliest_way import earliest_way, sealed
from ppg_env.game.game import Game
from ppg_env.game.goal_hits import hit_arrivals
from ppg_env.game.input_sets import LONGEST_HORIZON
from ppg_env.game.plan import Profile
from ppg_env.game.reachability import earliest_arrival, sufficient_horizon
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver, minimise, tidied
from solvers.liability import Liability, make_rule
from solvers.search_result import REFUTED, UNPROVED, SearchResult
from solvers.solution import ADVICE, Solution, Status
from solvers.units import in_units_of_the_game

LONGER = 10
"""Longer horizons are looked at up to this many times the game's, to say what would suffice."""


@in_units_of_the_game
def best_response(
    game: Game,
    agent: int,
    profile: Profile | None = None,
    *,
    charge: str = "selfish",
    solver: str = ENGINE,
    time_limit: float | None = None,
) -> Solution:
    """Find the cheapest plan of ``agent`` while all others keep theirs (MP2; MP1 if alone).

    Parameters
    ----------
    game, agent, profile
        The game, the index of the agent that plans, and the plans of all agents (its own is
        ignored; None only in a game of one agent).
    charge
        The liability rule (:mod:`solvers.liability`): ``selfish`` minimises J_i, ``partial:a``
        and ``pigou`` add a share or all of the harm to others, ``right-of-way`` lets one agent of
        each pair pay everything.
    solver, time_limit
        ``ENGINE`` or the name of a MILP solver that cvxpy knows; seconds, None for no limit.

    Returns
    -------
    Solution
        ``profile`` is the given one with the agent's plan replaced, ``value`` what it then pays
        (its shifted cost, if selfish), ``bound`` a proved lower bound on that.  Without a plan,
        ``status`` and ``advice`` give the reason.

    Raises
    ------
    InputError
        If there is no such agent, the profile does not fit, or the solver is not installed.
    """
    check_agent(game, agent)
    rule, budget = make_rule(game, charge), Budget(time_limit)
    response = respond(rule, agent, profile, check_solver(solver), budget)
    response = tidied(rule.costs[agent], (agent,), response)
    status, advice = explain(game, response, (agent,))
    return Solution(
        game,
        "best-response",
        status,
        advice,
        response.profile,
        response.evaluation,
        f"{'shifted_cost' if rule.charge == 'selfish' else 'charge'}[{agent}]",
        response.value,
        response.bound,
        seconds=budget.spent,
    )


def respond(
    rule: Liability, agent: int, profile: Profile | None, solver: str, budget: Budget
) -> SearchResult:
    """Return the best response of ``agent`` under a rule, for arguments that were checked."""
    size = len(rule.game.agents)
    if profile is None or len(profile) != size:
        require(
            size == 1,
            "profile",
            "does not have one plan per agent",
            "give a plan of every agent",
        )
    return minimise(rule.costs[agent], (agent,), profile, solver, budget)


def explain(game: Game, result: SearchResult, movers: tuple[int, ...]) -> tuple[Status, str]:
    """Return status and advice, with the agents named whose goals are out of reach."""
    status = result.status
    if status is Status.INFEASIBLE and any(earliest_way(game, i) is None for i in movers):
        status = Status.UNREACHABLE
    if status is Status.UNREACHABLE:
        return status, unreachable_advice(game, movers)
    advice = ADVICE[status].format(when=overlap_times(game))
    if status is Status.FEASIBLE and result.detail in (UNPROVED, REFUTED):
        advice = result.detail
    elif result.detail and status is Status.ERROR:
        advice += f" (it reported: {result.detail})"
    return status, advice


def unreachable_advice(game: Game, movers: tuple[int, ...]) -> str:
    """Return which goal cannot be reached in time, and the horizon that would suffice."""
    for i in movers:
        agent, name = game.agents[i], game.agent_names[i]
        if earliest_arrival(agent, game.horizon) is None:
            needed = sufficient_horizon(agent, LONGER * game.horizon)
            remedy = (
                "allow larger controls or others that lead to the goal, or change its within or "
                "reserve"
                if needed is None
                else f"set the horizon to {needed} or more"
            )
            return (
                f"{name} cannot reach its goal within the horizon of {game.horizon} even alone; "
                + remedy
            )
        if earliest_way(game, i) is None:
            hit = _hit_at_goal(game, i)
            return _walled_off(game, i) if hit is None else hit
    return ADVICE[Status.UNREACHABLE]


def _hit_at_goal(game: Game, agent: int) -> str | None:
    """Return the advice where obstacles that move hit an agent at its goal; None if none does."""
    name, waits = game.agent_names[agent], starts_at_goal(game.agents[agent])
    first = 0 if waits else earliest_arrival(game.agents[agent], game.horizon) or 0
    hits = hit_arrivals(game, agent)[:, first : first + 1 if waits else None]
    if not hits.any(axis=0).all():
        return None
    closing = " and ".join(f"obstacle {k}" for k in np.flatnonzero(hits[:, -1]))
    if waits:
        return (
            f"{name} starts at its goal and stays there, where {closing} hits it; move its start "
            'or its goal, change the path of the obstacle, or write on_goal = "remove"'
        )
    needed = _sufficient(game, agent)
    remedy = "move its goal" if needed is None else _raised(game.horizon, needed)
    return (
        f"{name} cannot arrive within the horizon of {game.horizon}: {closing} hits it at its goal "
        f"whenever it arrives; {remedy}, or change the path of the obstacle"
    )


def _raised(horizon: int, needed: int) -> str:
    """Return the remedy where an arrival takes ``needed`` steps or more.

    Coarse cells, or obstacles that are gone later, may give a number below the horizon.
    """
    return f"set the horizon to {needed} or more" if needed > horizon else "raise the horizon"


def _lengthened(game: Game) -> Game:
    """Return the game with the longest horizon that is tried for advice."""
    try:
        return replace(game, horizon=min(LONGER * game.horizon, LONGEST_HORIZON))
    except InputError:  # the game allows no such horizon
        return game


def _sufficient(game: Game, agent: int) -> int | None:
    """Return the least arrival that a longer horizon allows, if there is one."""
    return earliest_way(_lengthened(game), agent)


def _walled_off(game: Game, agent: int) -> str:
    """Return the advice where bodies at rest keep an agent from its goal."""
    name, needed = game.agent_names[agent], _sufficient(game, agent)
    if needed is not None:
        return (
            f"{name} cannot reach its goal around the obstacles within the horizon of "
            f"{game.horizon}; {_raised(game.horizon, needed)}"
        )
    parked = [] if game.on_goal == "remove" else _parked(game, agent)
    closing = " and ".join(["obstacles"] * bool(game.obstacles) + parked)
    remedy = f"open a gap wider than the body of {name}"
    longer = _lengthened(game)
    if sealed(longer, agent):
        return (
            f"{name} cannot reach its goal: every way is closed by {closing}; {remedy}, "
            "or move its start or goal"
        )
    return (
        f"{name} cannot reach its goal within the horizon of {game.horizon}, nor within one of "
        f"{longer.horizon}: every way that short is closed by {closing}; {remedy}, move its start "
        "or goal, or raise the horizon further"
    )


def _parked(game: Game, agent: int) -> list[str]:
    """Return the names of other agents that have arrived at time 0."""
    others = zip(game.agent_names, game.agents, strict=True)
    return [other for i, (other, a) in enumerate(others) if i != agent and starts_at_goal(a)]


def check_agent(game: Game, agent: int) -> None:
    """Raise InputError if the game has no agent of that index."""
    if not 0 <= agent < len(game.agents):
        raise InputError(
            "agent",
            f"is {agent} in a game of {len(game.agents)}",
            f"count from 0 to {len(game.agents) - 1}",
        )
