r"""Polishing: everybody's plans at once, with arrivals and faces as they are.

With each moment's best face fixed, what is left of any objective is convex, so one linear program
(with tangents) finds its least value.  Best responses in turn come to the same place by many small
steps; polishing takes them together.
"""

from __future__ import annotations

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import Evaluation, evaluate
from ppg_env.game.game import Game
from ppg_env.game.objective import Weights
from ppg_env.game.plan import Profile
from solvers.budget import Clock
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.engine.presolve import Task, meetings

ROUNDS = 10
"""Most rounds; each may choose other faces than the last."""


def polish(game: Game, profile: Profile, weights: Weights, clock: Clock) -> Profile:
    """Plans of all agents that cost no more, found without new faces or arrivals.

    ``profile`` has to be feasible, and comes back if there is nothing to gain.
    """
    value = evaluate(game, profile).weighted(weights)
    for _ in range(ROUNDS):
        if clock.out:
            break
        found = _round(game, profile, weights, clock)
        if found is None or found[1].weighted(weights) > value - tol.IMPROVEMENT:
            break
        profile, value = found[0], found[1].weighted(weights)
    return profile


def _round(
    game: Game, profile: Profile, weights: Weights, clock: Clock
) -> tuple[Profile, Evaluation] | None:
    movers = range(len(profile))
    arrivals = {i: plan.arrival or 0 for i, plan in enumerate(profile)}
    task = Task(game, tuple(movers), weights, {})
    known = meetings(task, range(len(game.encounters)), arrivals)
    if known is None:
        return None
    program = FixedProgram(task, arrivals, known)
    point = Relaxation(program, 0.0, clock).settle([plan.means for plan in profile])
    if point is None:
        return None
    plans = program.plans(point)
    evaluation = evaluate(game, plans)
    return None if evaluation.complaints() else (plans, evaluation)
