r"""Enumerate equilibria of one game, each named by who passes whom on which side.

Best-response dynamics end in different equilibria from different starts and orders.  They are
certified, distinguished by their passing sides, and compared by social cost and by risk.

In two dimensions the displacement r_i - r_j turns while two agents pass each other: by more than a
right angle to the left (counter-clockwise) if they keep each other on their left, to the right
otherwise.  Other dimensions have no sides, and equilibria are distinguished by their costs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.game import Game
from ppg_env.game.margins import end_of_traffic
from ppg_env.game.plan import Profile
from solvers.dispatch import ENGINE
from solvers.equilibrium.best_response_dynamics import best_response_dynamics
from solvers.equilibrium.start_profile import STARTS
from solvers.solution import Solution, Status
from solvers.units import in_units_of_the_game

PASSING = np.pi / 2
"""Two agents pass each other if their displacement turns by more than this."""

NO_PASSING = "nobody passes"  # codespell:ignore nobody
"""Name of an equilibrium in which no two agents pass; stored results have it, so it stays."""


@dataclass(frozen=True)
class Equilibrium:
    """One kind of equilibrium.

    Attributes
    ----------
    name : who passes whom on which side, such as ``0<1 left, 1<2 right``, or ``NO_PASSING``.
    solution : the cheapest certified profile of this kind.
    found : number of runs that ended in this kind.
    """

    name: str
    solution: Solution
    found: int


@in_units_of_the_game
def collect_equilibria(
    game: Game,
    *,
    runs: int = 20,
    seed: int = 0,
    charge: str = "selfish",
    solver: str = ENGINE,
    time_limit: float | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Equilibrium]:
    """Return the distinct certified equilibria of ``runs`` runs of the dynamics, cheapest first.

    Runs differ in their start (straight, sequential) and in the order of the agents, drawn from
    ``seed``.  Equilibria of one name are one kind, of which the cheapest is kept.
    ``charge`` is the liability rule under which they are equilibria.  ``time_limit`` (seconds)
    applies to each run; ``progress`` is called after each with its number.
    """
    kinds: dict[str, Equilibrium] = {}
    for run, (start, order) in enumerate(_runs(game, runs, seed)):
        solution = best_response_dynamics(
            game, start=start, order=order, charge=charge, solver=solver, time_limit=time_limit
        )
        if progress is not None:
            progress(run + 1)
        if solution.status is not Status.EQUILIBRIUM or solution.profile is None:
            continue
        name = passing(game, solution.profile)
        if game.dim != 2:
            name = f"social cost {_cost(solution):.4f}"
        previous = kinds.get(name)
        count = 1 if previous is None else previous.found + 1
        if previous is not None and _cost(solution) >= _cost(previous.solution) - tol.IMPROVEMENT:
            solution = previous.solution
        kinds[name] = Equilibrium(name, solution, count)
    return sorted(kinds.values(), key=lambda kind: (_cost(kind.solution), kind.name))


def _runs(game: Game, runs: int, seed: int) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield the start and the order of each run."""
    random, size = np.random.default_rng(seed), len(game.agents)
    order = tuple(range(size))
    for run in range(runs):
        if run >= len(STARTS) and run % len(STARTS) == 0:
            order = tuple(int(i) for i in random.permutation(size))
        yield STARTS[run % len(STARTS)], order


def _cost(solution: Solution) -> float:
    assert solution.evaluation is not None
    return float(solution.evaluation.social_cost)


def passing(game: Game, profile: Profile) -> str:
    """Return who passes whom on which side, pairs in ascending order."""
    words = []
    for encounter in game.encounters:
        if len(encounter.agents) < 2 or game.dim != 2:
            continue
        i, j = encounter.agents
        end = end_of_traffic(game, encounter, [plan.arrival for plan in profile])
        until = min(end, game.horizon)
        displacements = (profile[i].means - profile[j].means)[: until + 1, :2]
        angles = np.unwrap(np.arctan2(displacements[:, 1], displacements[:, 0]))
        turn = float(angles[-1] - angles[0])
        if abs(turn) > PASSING:
            words.append(f"{i}<{j} {'left' if turn > 0 else 'right'}")
    return ", ".join(words) or NO_PASSING
