r"""Refine a feasible profile: all plans at once, with arrivals and faces as they are.

With the best face of each disjunction fixed, the rest of any objective is convex, so one linear
program (with tangents) finds its least value.  Alternating best responses reach the same point in
many small steps.
"""

from __future__ import annotations

from ppg_env import tolerances as tol
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import Relaxation
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.pricing import PricedProfile, price, price_profile

ROUNDS = 10
"""Largest number of rounds; each may choose other faces than the last."""


def refine(objective: Objective, profile: Profile, budget: Budget) -> Profile:
    """Return plans of all agents that cost no more, without new faces or arrivals.

    ``profile`` must be feasible; it is returned if no improvement is found.
    """
    best = price_profile(objective, profile)
    for _ in range(ROUNDS):
        if best is None or budget.out:
            break
        better = _reoptimised(objective, best.profile, budget)
        if better is None or better.value > best.value - tol.IMPROVEMENT:
            break
        best, profile = better, better.profile
    return profile


def _reoptimised(objective: Objective, profile: Profile, budget: Budget) -> PricedProfile | None:
    """Return the optimum for the arrivals and the best faces of ``profile``, if feasible."""
    arrivals = {i: plan.arrival or 0 for i, plan in enumerate(profile)}
    subproblem = Subproblem(objective, tuple(arrivals), {})
    presolved = presolve_encounters(subproblem, subproblem.encounters, arrivals)
    if presolved is None:
        return None
    program = FixedProgram(subproblem, arrivals, presolved)
    point = Relaxation(program, 0.0, budget).solve_at([plan.means for plan in profile])
    return None if point is None else price(objective, program.controls_at(point), {})
