"""Players by name: a registry of what each accepts, where it plays, and how to create it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from baselines.policy_file import Learned
from baselines.pretrained import PLAYERS as PRETRAINED
from ppg_env.env.players import Player, track
from ppg_env.errors import InputError, require
from ppg_env.game.between_steps import overlap_times
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.plan import Profile
from solvers import planner_options
from solvers.feedback.grid.feedback_solution import FeedbackSolution, PairwiseSolution
from solvers.planner_options import PlannerOptions
from solvers.solution import Solution, Status

ARENAS = ("schedule", "env")
"""Where players meet: plans on their schedule, or the environment."""

REPLANNING = {"receding-nash": "nash", "receding-social": "social"}
"""Players that plan again for all agents at every step, and whose plans they fall back on."""

Feedback = FeedbackSolution | PairwiseSolution
"""Policies from dynamic programming."""

FILE = ".npz"
"""A player whose name ends so is a file of learned players."""


@dataclass(frozen=True)
class PlayerEntry:
    """Static description of a player.

    Attributes
    ----------
    name : on the command line and in tables.
    create : makes its plans or policies, or loads them.
    accepts : the planner options that it uses.
    arena : ``env`` if it needs the environment, else ``schedule``.
    information : what it observes while playing.
    improves : whether ``create`` takes known plans as ``start``, and plans none that cost more.
    """

    name: str
    create: Callable[..., Solution | Learned | Feedback]
    accepts: tuple[str, ...] = ()
    arena: str = "schedule"
    information: str = "own state, or open loop without gain"
    improves: bool = False


def _nash(game: Game, options: PlannerOptions) -> Solution:
    """Find an equilibrium by best-response dynamics."""
    from solvers.equilibrium.best_response_dynamics import best_response_dynamics

    return best_response_dynamics(
        game,
        start=options.start,
        order=options.order,
        charge=options.charge,
        seed=options.seed,
        solver=options.solver,
        time_limit=options.time_limit,
    )


def _potential(game: Game, options: PlannerOptions) -> Solution:
    """Minimise the potential."""
    from solvers.optimum.joint import potential_equilibrium

    return potential_equilibrium(game, **options.search())


def _social(game: Game, options: PlannerOptions, start: Profile | None = None) -> Solution:
    """Minimise the social cost."""
    from solvers.optimum.joint import social_optimum

    return social_optimum(game, start=start, **options.search())


def _straight(game: Game, _options: PlannerOptions) -> Solution:
    """Plan the straight way for each agent as if it were alone; means may overlap."""
    from solvers.equilibrium.best_response import unreachable_advice

    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    profile = tuple(plan for plan in plans if plan is not None)
    if len(profile) < len(plans):
        advice = unreachable_advice(game, tuple(range(len(plans))))
        return Solution(game, "straight", Status.UNREACHABLE, advice)
    evaluation = evaluate(game, profile)
    advice = "; ".join(evaluation.violations()) or f"free of overlap {overlap_times(game)}"
    status = Status.FEASIBLE if evaluation.feasible else Status.INFEASIBLE
    return Solution(game, "straight", status, advice, profile, evaluation)


def _feedback(kind: str, game: Game, options: PlannerOptions) -> FeedbackSolution:
    """Compute the feedback ``equilibrium`` or ``optimum`` on a grid."""
    from solvers.feedback.grid.dynamic_programming import feedback_equilibrium, feedback_optimum

    solve = feedback_equilibrium if kind == "equilibrium" else feedback_optimum
    return solve(game, time_limit=options.time_limit)


def _pairwise(game: Game, options: PlannerOptions, *, social: bool) -> PairwiseSolution:
    """Solve all pairs of agents on grids."""
    from solvers.feedback.grid.pairwise import pairwise_policies

    return pairwise_policies(game, social=social, time_limit=options.time_limit)


def _pretrained(name: str, game: Game, _options: PlannerOptions) -> Learned:
    from baselines.pretrained import find_pretrained

    return find_pretrained(name, game)


def _from_file(name: str, game: Game, _options: PlannerOptions) -> Learned | FeedbackSolution:
    from baselines.policy_file import read_learned
    from solvers.feedback.grid.policy_file import is_feedback, read_feedback

    if is_feedback(name):
        return read_feedback(name)
    learned = read_learned(name)
    if not learned.fits(game):
        warnings.warn(f"{name} was trained for another game than this one.", stacklevel=2)
    return learned


_SEARCH = planner_options.SEARCH
_DYNAMICS = ("solver", "time_limit", "seed", "start", "order")
_LEARNED = ((), "env", "full state")
_GRID = (("time_limit",), "env", "full state")

PLAYERS: dict[str, PlayerEntry] = {
    entry.name: entry
    for entry in (
        PlayerEntry("nash", _nash, (*_DYNAMICS, "charge")),
        PlayerEntry("potential", _potential, _SEARCH),
        PlayerEntry("social", _social, _SEARCH, improves=True),
        PlayerEntry("straight", _straight),
        PlayerEntry("receding-nash", _nash, (*_DYNAMICS, "charge"), "env", "full state"),
        PlayerEntry("receding-social", _social, _SEARCH, "env", "full state", improves=True),
        PlayerEntry("feedback-nash", partial(_feedback, "equilibrium"), *_GRID),
        PlayerEntry("feedback-social", partial(_feedback, "optimum"), *_GRID),
        PlayerEntry("pairwise-nash", partial(_pairwise, social=False), *_GRID),
        PlayerEntry("pairwise-social", partial(_pairwise, social=True), *_GRID),
        *(PlayerEntry(name, partial(_pretrained, name), *_LEARNED) for name in PRETRAINED),
    )
}
"""Every named player; a file of learned players is one too, see :func:`find_player`."""


def find_player(name: str) -> PlayerEntry:
    """Return the entry of the player called ``name``, or of a file of learned players."""
    if name.endswith(FILE):
        return PlayerEntry(name, partial(_from_file, name), *_LEARNED)
    return PLAYERS[name]


@dataclass(frozen=True)
class Entrant:
    """A player that has planned or loaded, ready to play.

    Attributes
    ----------
    name : the requested name.
    solution : its plans, for planners.
    learned : its policies, for learners.
    feedback : its policies, for dynamic programming.
    """

    name: str
    solution: Solution | None = None
    learned: Learned | None = None
    feedback: Feedback | None = None

    @property
    def runs(self) -> int:
        """Independent trainings; one for planners."""
        return 1 if self.learned is None else len(self.learned.runs)

    def policies(self, game: Game, options: PlannerOptions) -> list[Sequence[Player]]:
        """Return, for each run, the player of each agent in the environment.

        The list is empty if there is no plan.
        """
        if self.learned is not None:
            return [self.learned.players(game, run) for run in range(self.runs)]
        if self.feedback is not None:
            return [self.feedback.players()]
        if self.solution is None or self.solution.profile is None:
            return []
        if self.name in REPLANNING:
            from solvers.feedback.replanning.replanner import replanning

            social = REPLANNING[self.name] == "social"
            return [replanning(game, self.solution.profile, social=social)]
        return [track(game, self.solution.profile)]


def entrant(
    name: str, game: Game, options: PlannerOptions, known: Profile | None = None
) -> Entrant:
    """Let a planner plan with the options that it accepts, or load a learner.

    ``known`` are plans from which a player starts that can improve them.
    """
    player = find_player(name)
    create = partial(player.create, start=known) if player.improves else player.create
    result = create(game, options.only(player.accepts))
    if isinstance(result, Learned):
        return Entrant(name, learned=result)
    if isinstance(result, Feedback):
        return Entrant(name, feedback=result)
    return Entrant(name, solution=result)


def entrants(
    names: Sequence[str],
    game: Game,
    options: PlannerOptions,
    progress: Callable[[str], None] = lambda _player: None,
) -> list[Entrant]:
    """Return an entrant for each of ``names``; ``progress`` is called with the name of each.

    Players that can improve known plans come last, and start from the cheapest of the others.
    """
    ready: dict[str, Entrant] = {}
    for name in sorted(names, key=lambda name: find_player(name).improves):
        progress(name)
        solutions = (other.solution for other in ready.values())
        known = min(filter(None, solutions), key=_social_cost, default=None)
        profile = None if known is None else known.profile
        ready[name] = entrant(name, game, options, profile)
    return [ready[name] for name in names]


def _social_cost(solution: Solution) -> float:
    """Return the social cost of the plans; infinite where they overlap, or are missing."""
    priced = solution.evaluation
    return priced.social_cost if priced is not None and priced.feasible else np.inf


def chosen_players(
    text: str, arena: str | None = None, place: str = "--players"
) -> tuple[list[str], str]:
    """Return the names in a comma-separated list, and the arena.

    The arena is the environment if a player needs it, else the schedule.  ``place`` is the option
    that error messages name.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in PLAYERS and not name.endswith(FILE)]
    if unknown or not names:
        raise InputError(
            place,
            f"has {unknown[0]!r}" if unknown else "is empty",
            "use names of " + ", ".join(PLAYERS) + f", or files ending in {FILE}",
        )
    needy = [name for name in names if find_player(name).arena == "env"]
    if needy and arena == "schedule":
        raise InputError(place, f"has {needy[0]}, which needs the environment", "add --arena env")
    return list(dict.fromkeys(names)), arena or ("env" if needy else "schedule")


def chosen_player(text: str, arena: str | None = None, place: str = "--player") -> tuple[str, str]:
    """Return the one name in ``text``, and the arena; see :func:`chosen_players`."""
    names, arena = chosen_players(text, arena, place)
    require(len(names) == 1, place, "has several names", "name one")
    return names[0], arena


def check_arena(arena: str | None, place: str = "--arena") -> None:
    """Refuse a name that is not one of :data:`ARENAS`; None is no choice."""
    require(
        arena is None or arena in ARENAS, place, f"is {arena!r}", "write " + " or ".join(ARENAS)
    )


def refuse_unused(options: PlannerOptions, names: Sequence[str]) -> None:
    """Refuse an option that none of the players ``names`` accepts."""
    entries = [*PLAYERS.values(), *map(find_player, names)]
    planner_options.refuse_unused(options, names, {e.name: e.accepts for e in entries})
