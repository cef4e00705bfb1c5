r"""The tie rule: among plans of equal cost the shortest, and among those the smoothest.

With arrivals and faces as they are, and no margin that counts smaller than it is, two linear
programs minimise

    sum_i sum_t |u_it|_1,     then  sum_i sum_t |u_i,t+1 - u_it|_1  without a larger first sum.

The margins of an encounter may be distributed otherwise over its events if their sum counts
(objective ``margin``); for ``risk``, where losses are strictly convex, every margin is kept.  The
evaluator confirms that the cost has not risen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Plan, Profile
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.node_lp import OPTIONS, Faces
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.pricing import PricedProfile, price, price_profile

ROUNDING = 1e-8
"""Relative rise of a cost that rounding in the programs explains."""


def break_ties(
    objective: Objective, movers: tuple[int, ...], given: Mapping[int, Plan], best: PricedProfile
) -> PricedProfile:
    """Return plans of ``movers`` that cost no more than ``best``, by the rule of this module.

    ``given`` are the plans of the other agents.  If the back end fails, ``best`` is returned.
    """
    arrivals = {i: best.profile[i].arrival or 0 for i in movers}
    subproblem = Subproblem(objective, movers, given)
    presolved = presolve_encounters(subproblem, subproblem.encounters, arrivals)
    if presolved is None or not any(arrivals.values()):
        return best
    program = FixedProgram(subproblem, arrivals, presolved)
    _keep_margins(program, [plan.means for plan in best.profile])
    sizes = {i: program.add_sizes(u) for i, u in program.controls.items()}
    _keep_efforts(program, sizes, best)
    differences = [
        program.add_differences(one, other)
        for u in program.controls.values()
        for one, other in pairwise(u)
    ]
    columns = [np.concatenate([c.ravel() for c in part] or [np.zeros(0, dtype=int)])
               for part in (sizes.values(), differences)]  # fmt: skip
    point = _minimised_in_turn(program.highs_model(), columns)
    tidy = None if point is None else price(objective, program.controls_at(point), given)
    if tidy is None or tidy.value > best.value + ROUNDING * max(1.0, abs(best.value)):
        return best
    return tidy if _is_tidier(tidy, best, movers) else best


def tidied_in_turn(costs: Sequence[Objective], profile: Profile) -> Profile:
    """Return ``profile`` after the rule was applied to each agent's plan in turn.

    ``costs`` are those of the agents.  The losses of every encounter are kept, so no cost rises;
    an infeasible profile is returned as it is.
    """
    for i, cost in enumerate(costs):
        best = price_profile(cost, profile)
        if best is None:
            break
        others = {j: plan for j, plan in enumerate(profile) if j != i}
        profile = break_ties(cost, (i,), others, best).profile
    return profile


def _is_tidier(one: PricedProfile, other: PricedProfile, movers: tuple[int, ...]) -> bool:
    """Return whether one profile is shorter, or as short and smoother, by more than rounding."""
    for size in (_length, _roughness):
        sizes = [sum(size(plans.profile[i].controls) for i in movers) for plans in (one, other)]
        if abs(sizes[0] - sizes[1]) > tol.LENGTH * max(1.0, sizes[1]):
            return bool(sizes[0] < sizes[1])
    return False


def _length(controls: np.ndarray) -> float:
    return float(np.abs(controls).sum())


def _roughness(controls: np.ndarray) -> float:
    return float(np.abs(np.diff(controls, axis=0)).sum())


def _keep_margins(program: FixedProgram, means: list[np.ndarray]) -> None:
    """Require the best face of every undecided event at ``means``, with its margin."""
    if not program.disjunctions:
        return
    faces = Faces(program.disjunctions)
    margins = faces.margins(program.point_at(means))
    losses: dict[int, list[tuple[int, float]]] = {}
    for k, part in enumerate(np.split(margins, faces.first[1:])):
        disjunction, p = program.disjunctions[k], int(part.argmax())
        margin = float(np.clip(part[p], 0.0, disjunction.cap))
        program.require_face(k, p)
        if disjunction.weight <= 0:
            continue
        if disjunction.margin is not None:
            program.raise_floor(disjunction.margin, margin)
        else:
            loss = program.game.margin_cap - margin
            losses.setdefault(disjunction.encounter, []).append((disjunction.loss, loss))
    for pairs in losses.values():
        columns, values = zip(*pairs, strict=True)
        program.limit(columns, np.ones(len(columns)), float(sum(values)))


def _keep_efforts(
    program: FixedProgram, sizes: Mapping[int, np.ndarray], best: PricedProfile
) -> None:
    """Require that the cost of all efforts does not rise."""
    weights = program.subproblem.objective.effort
    paid = {i: float(weights[i]) for i in sizes if weights[i] > 0}
    if paid:
        columns = np.concatenate([sizes[i].ravel() for i in paid])
        values = np.concatenate([np.full(sizes[i].size, weight) for i, weight in paid.items()])
        total = sum(weight * best.evaluation.effort[i] for i, weight in paid.items())
        program.limit(columns, values, float(total))


def _minimised_in_turn(model: Any, parts: list[np.ndarray]) -> np.ndarray | None:
    """Return a point that minimises the sum of the first columns, then that of the next ones."""
    import highspy

    lp = highspy.Highs()
    for name, value in OPTIONS.items():
        lp.setOptionValue(name, value)
    lp.passModel(model)
    every = np.arange(model.num_col_, dtype=np.int32)
    point = None
    for columns in parts:
        costs = np.zeros(model.num_col_)
        costs[columns] = 1.0
        lp.changeColsCost(model.num_col_, every, costs)
        lp.run()
        if lp.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            break
        point = np.array(lp.getSolution().col_value)
        least = float(lp.getInfo().objective_function_value)
        numbers = columns.astype(np.int32)
        lp.addRow(-np.inf, least + tol.MIP_GAP, len(numbers), numbers, np.ones(len(numbers)))
    return point
