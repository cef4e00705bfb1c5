"""Players by name: each turns a game into the profile that it would play."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ppg_env.errors import InputError
from ppg_env.evaluate import evaluate
from ppg_env.game import Game
from ppg_env.plan import Profile, straight_plan
from ppg_env.players import Player, track
from solvers.solution import Solution, Status


@dataclass(frozen=True)
class Limits:
    """What a player may use: a MILP solver, seconds (None: no limit), and a seed."""

    solver: str = "HIGHS"
    time_limit: float | None = None
    seed: int = 0


def nash(game: Game, limits: Limits) -> Solution:
    """Equilibrium found by best-response dynamics from straight lines."""
    from solvers.dynamics import best_response_dynamics

    return best_response_dynamics(
        game, solver=limits.solver, time_limit=limits.time_limit, seed=limits.seed
    )


def potential(game: Game, limits: Limits) -> Solution:
    """Equilibrium that minimises the potential."""
    from solvers.joint import potential_equilibrium

    return potential_equilibrium(game, solver=limits.solver, time_limit=limits.time_limit)


def social(game: Game, limits: Limits) -> Solution:
    """Optimum of the sum of all costs."""
    from solvers.joint import social_optimum

    return social_optimum(game, solver=limits.solver, time_limit=limits.time_limit)


def straight(game: Game, _limits: Limits) -> Solution:
    """Everybody heads for its goal as if alone; means may overlap."""
    from solvers.response import unreachable_advice

    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    profile = tuple(plan for plan in plans if plan is not None)
    if len(profile) < len(plans):
        advice = unreachable_advice(game, tuple(range(len(plans))))
        return Solution(game, "straight", Status.UNREACHABLE, advice)
    judged = evaluate(game, profile)
    advice = "; ".join(judged.complaints()) or "free of overlap"
    status = Status.FEASIBLE if judged.feasible else Status.INFEASIBLE
    return Solution(game, "straight", status, advice, profile, judged)


PLANNERS: dict[str, Callable[[Game, Limits], Solution]] = {
    "nash": nash,
    "potential": potential,
    "social": social,
    "straight": straight,
}


RECEDING = "receding"
"""Starts with the plans of ``nash`` and makes them anew every few steps; for the environment."""


def plan_of(player: str, game: Game, limits: Limits) -> Solution:
    """The plans that a player starts from."""
    return PLANNERS["nash" if player == RECEDING else player](game, limits)


def policies_of(player: str, game: Game, profile: Profile, limits: Limits) -> Sequence[Player]:
    """Who plays each agent in the environment."""
    if player == RECEDING:
        from solvers.players import receding_horizon

        return receding_horizon(game, profile, solver=limits.solver)
    return track(game, profile)


def chosen_players(text: str, arena: str = "schedule") -> list[str]:
    """Player names of a comma-separated list, checked against what the arena can play."""
    known = [*PLANNERS, RECEDING] if arena == "env" else list(PLANNERS)
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in known]
    if RECEDING in unknown:
        raise InputError(
            "--players", f"has {RECEDING}, which needs the environment", "add --arena env"
        )
    if unknown or not names:
        raise InputError(
            "--players",
            f"has {unknown[0]!r}" if unknown else "is empty",
            "use names of " + ", ".join(known),
        )
    return list(dict.fromkeys(names))
