"""Players by name: each turns a game into the profile that it would play."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from baselines.policy_file import Learned
from baselines.pretrained import PLAYERS as PRETRAINED
from ppg_env.env.players import Player, track
from ppg_env.errors import InputError
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from solvers.solution import Solution, Status


@dataclass(frozen=True)
class PlannerOptions:
    """What a player may use, and how it goes about it.

    Attributes
    ----------
    solver : the MILP solver.
    time_limit : seconds; None is no limit.
    seed : of everything random.
    node_limit : linear programs of ``potential`` and ``social``; None is no limit.
    start, order : first profile and order of moves of ``nash``; None is the planner's own choice.
    charge : rule of liability of ``nash``, see :mod:`solvers.liability`.
    """

    solver: str = "ENGINE"
    time_limit: float | None = None
    seed: int = 0
    node_limit: int | None = None
    start: str | None = None
    order: str | tuple[int, ...] = "cyclic"
    charge: str = "selfish"

    @property
    def common(self) -> dict[str, Any]:
        """The options that all planners take."""
        return {"solver": self.solver, "time_limit": self.time_limit, "seed": self.seed}


def nash(game: Game, limits: PlannerOptions) -> Solution:
    """Equilibrium found by best-response dynamics."""
    from solvers.equilibrium.best_response_dynamics import best_response_dynamics

    return best_response_dynamics(
        game,
        start=limits.start,
        order=limits.order,
        charge=limits.charge,
        **limits.common,
    )


def potential(game: Game, limits: PlannerOptions) -> Solution:
    """Equilibrium that minimises the potential."""
    from solvers.optimum.joint import potential_equilibrium

    return potential_equilibrium(
        game,
        node_limit=limits.node_limit,
        **limits.common,
    )


def social(game: Game, limits: PlannerOptions) -> Solution:
    """Optimum of the sum of all costs."""
    from solvers.optimum.joint import social_optimum

    return social_optimum(
        game,
        node_limit=limits.node_limit,
        **limits.common,
    )


def straight(game: Game, _limits: PlannerOptions) -> Solution:
    """Everybody heads for its goal as if alone; means may overlap."""
    from solvers.equilibrium.best_response import unreachable_advice

    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    profile = tuple(plan for plan in plans if plan is not None)
    if len(profile) < len(plans):
        advice = unreachable_advice(game, tuple(range(len(plans))))
        return Solution(game, "straight", Status.UNREACHABLE, advice)
    judged = evaluate(game, profile)
    advice = "; ".join(judged.violations()) or "free of overlap"
    status = Status.FEASIBLE if judged.feasible else Status.INFEASIBLE
    return Solution(game, "straight", status, advice, profile, judged)


PLANNERS: dict[str, Callable[[Game, PlannerOptions], Solution]] = {
    "nash": nash,
    "potential": potential,
    "social": social,
    "straight": straight,
}


ARENAS = ("schedule", "env")
"""Where players meet: plans on their schedule, or the environment."""

RECEDING = "receding"
"""Starts with the plans of ``nash`` and makes them anew every few steps; for the environment."""

FILE = ".npz"
"""A player's name that ends so is a file of learned players."""


@dataclass(frozen=True)
class Entrant:
    """A player by name, ready to play.

    Attributes
    ----------
    name : as it was asked for.
    solution : its plans, for planners.
    learned : its policies, for learners.
    """

    name: str
    solution: Solution | None = None
    learned: Learned | None = None

    @property
    def runs(self) -> int:
        """Independent trainings; one for planners."""
        return 1 if self.learned is None else len(self.learned.runs)

    def policies(self, game: Game, limits: PlannerOptions) -> list[Sequence[Player]]:
        """Who plays each agent in the environment, for each run; empty without a plan."""
        if self.learned is not None:
            return [self.learned.players(game, run) for run in range(self.runs)]
        if self.solution is None or self.solution.profile is None:
            return []
        if self.name == RECEDING:
            from solvers.feedback.receding_horizon import receding_horizon

            return [receding_horizon(game, self.solution.profile, solver=limits.solver)]
        return [track(game, self.solution.profile)]


def entrant(name: str, game: Game, limits: PlannerOptions) -> Entrant:
    """Let a planner plan, or load a learner."""
    if name.endswith(FILE):
        from baselines.policy_file import read_learned

        learned = read_learned(name)
        if not learned.fits(game):
            warnings.warn(f"{name} was trained for another game than this one.", stacklevel=2)
        return Entrant(name, learned=learned)
    if name in PRETRAINED:
        from baselines.pretrained import find_pretrained

        return Entrant(name, learned=find_pretrained(name, game))
    plan = PLANNERS["nash" if name == RECEDING else name]
    return Entrant(name, plan(game, limits))


def known_players() -> list[str]:
    """All names; besides, a learner's file is a player."""
    return [*PLANNERS, RECEDING, *PRETRAINED]


def chosen_players(
    text: str, arena: str | None = None, place: str = "--players"
) -> tuple[list[str], str]:
    """Player names of a comma-separated list, and the arena: the environment if one needs it.

    ``place`` is where they were written, for those who wrote something else.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in known_players() and not name.endswith(FILE)]
    if unknown or not names:
        raise InputError(
            place,
            f"has {unknown[0]!r}" if unknown else "is empty",
            "use names of " + ", ".join(known_players()) + f", or files ending in {FILE}",
        )
    needy = [name for name in names if name not in PLANNERS]
    if needy and arena == "schedule":
        raise InputError(place, f"has {needy[0]}, which needs the environment", "add --arena env")
    return list(dict.fromkeys(names)), arena or ("env" if needy else "schedule")
