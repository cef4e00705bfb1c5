r"""Polishing: everybody's plans at once, with arrivals and faces as they are.

With each disjunction's best face fixed, what is left of any objective is convex, so one linear
program
(with tangents) finds its least value.  Best responses in turn come to the same place by many small
steps; polishing takes them together.
"""

from __future__ import annotations

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import Evaluation, evaluate
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.engine.presolve import Subproblem, presolve_encounters

ROUNDS = 10
"""Most rounds; each may choose other faces than the last."""


def refine(objective: Objective, profile: Profile, budget: Budget) -> Profile:
    """Plans of all agents that cost no more, found without new faces or arrivals.

    ``profile`` has to be feasible, and comes back if there is nothing to gain.
    """
    value = evaluate(objective.game, profile).weighted(objective)
    for _ in range(ROUNDS):
        if budget.out:
            break
        found = _round(objective, profile, budget)
        if found is None or found[1].weighted(objective) > value - tol.IMPROVEMENT:
            break
        profile, value = found[0], found[1].weighted(objective)
    return profile


def _round(
    objective: Objective, profile: Profile, budget: Budget
) -> tuple[Profile, Evaluation] | None:
    movers = range(len(profile))
    arrivals = {i: plan.arrival or 0 for i, plan in enumerate(profile)}
    subproblem = Subproblem(objective, tuple(movers), {})
    known = presolve_encounters(subproblem, subproblem.encounters, arrivals)
    if known is None:
        return None
    program = FixedProgram(subproblem, arrivals, known)
    point = Relaxation(program, 0.0, budget).settle([plan.means for plan in profile])
    if point is None:
        return None
    plans = program.plans(point)
    evaluation = evaluate(objective.game, plans)
    return None if evaluation.violations() else (plans, evaluation)
