r"""The exact engine: search over arrival vectors, and over faces where it matters.

With the arrivals T of all movers fixed, time costs are known and the reachable sets are tight, so
what is left is small (:mod:`solvers.fixed`).  Vectors are taken in the order of a lower bound,

    L(T) = sum_i tau_i T_i + sum_e omega_e (least loss that the reachable sets allow),

and the search ends when the next bound reaches the best plans in hand.  For each vector a tree is
searched (:mod:`solvers.branching`).  The smallest of all bounds is the proof: it holds whenever
the search is stopped, since what was not finished counts with what is known of it.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence

from ppg_env import tolerances as tol
from ppg_env.dynamics import earliest_arrival
from ppg_env.evaluate import evaluate
from ppg_env.game import Game
from ppg_env.objective import Weights
from ppg_env.plan import Plan, Profile, make_plan
from solvers.branching import Task, Tree
from solvers.clock import Clock
from solvers.fixed import Meeting, meeting
from solvers.found import Found
from solvers.solution import Status


def engine_search(
    game: Game, movers: Sequence[int], weights: Weights, given: Profile | None, clock: Clock
) -> Found:
    """The cheapest plans of ``movers``, with a proved bound, while the others keep to ``given``.

    If ``given`` has sound plans of the movers too, only cheaper ones are looked for.
    """
    task = Task(game, tuple(movers), weights, _others(game, movers, given))
    first = {i: earliest_arrival(game.agents[i], game.horizon) for i in movers}
    if any(start is None for start in first.values()):
        return Found(Status.UNREACHABLE, float("inf"))
    best, proved = _incumbent(task, given), float("inf")
    for bound, arrivals, meetings in _vectors(task, {i: int(t or 0) for i, t in first.items()}):
        if bound >= best.value - tol.MIP_GAP:
            break
        tree = Tree(task, arrivals, meetings, best, clock)
        finished = not clock.out and tree.search()
        best, proved = tree.best, min(proved, max(bound, tree.proved) if finished else bound)
        if not finished:
            status = Status.TIME_LIMIT if best.profile is None else Status.FEASIBLE
            return _with(best, status, proved)
    if best.profile is None:
        return Found(Status.INFEASIBLE, float("inf"))
    return _with(best, Status.OPTIMAL, min(proved, best.value))


def _others(game: Game, movers: Sequence[int], given: Profile | None) -> dict[int, Plan]:
    if given is None:
        return {}
    return {i: plan for i, plan in enumerate(given) if i not in movers}


def _incumbent(task: Task, given: Profile | None) -> Found:
    """The plans in hand, if they are sound; their cost cuts the search short from the start."""
    nothing = Found(Status.INFEASIBLE, float("inf"))
    if given is None:
        return nothing
    # What the others do may be a prediction; the movers' plans have to be what their controls do.
    plans = tuple(
        make_plan(agent, plan.controls) if i in task.movers else plan
        for i, (agent, plan) in enumerate(zip(task.game.agents, given, strict=True))
    )
    if any(plans[i].arrival is None for i in task.movers):
        return nothing
    evaluation = evaluate(task.game, plans, as_given=True)
    if evaluation.complaints(task.movers):
        return nothing
    value = evaluation.weighted(task.weights)
    return Found(Status.FEASIBLE, float("-inf"), plans, evaluation, value)


def _with(found: Found, status: Status, bound: float) -> Found:
    return Found(status, bound, found.profile, found.evaluation, found.value)


def _vectors(
    task: Task, first: Mapping[int, int]
) -> Iterator[tuple[float, dict[int, int], list[Meeting]]]:
    """Arrival vectors that the reachable sets allow, cheapest bound first.

    A vector waits with the cost of its time, which is quickly known, until it comes up; only
    then are its meetings looked at, and its successors, which cost no less, let in: those one
    step later in the coordinate that was raised last, or in one after it.
    """
    game, movers = task.game, task.movers
    concerned = [
        e for e, encounter in enumerate(game.encounters) if set(encounter.agents) & set(movers)
    ]

    def waiting(times: tuple[int, ...], raised: int) -> tuple[float, tuple[int, ...], int, None]:
        spent = sum(task.weights.time[i] * t for i, t in zip(movers, times, strict=True))
        return float(spent), times, raised, None

    queue: list[tuple[float, tuple[int, ...], int, list[Meeting] | None]]
    queue = [waiting(tuple(first[i] for i in movers), 0)]
    while queue:
        bound, times, raised, meetings = heapq.heappop(queue)
        arrivals = dict(zip(movers, times, strict=True))
        if meetings is not None:
            yield bound, arrivals, meetings
            continue
        for k in range(raised, len(times)):
            if times[k] < game.horizon:
                later = (*times[:k], times[k] + 1, *times[k + 1 :])
                heapq.heappush(queue, waiting(later, k))
        found = [meeting(game, e, arrivals, task.given) for e in concerned]
        known = [one for one in found if one is not None]
        if len(known) == len(found):
            losses = sum(task.weights.encounter[m.index] * (m.settled + m.least) for m in known)
            heapq.heappush(queue, (bound + float(losses), times, -1, known))
