"""One run of a solver on one game: ours by name, or any command that reads and writes files.

A command has the placeholders ``{game}`` and ``{plan}``, the files to read and to write, and may
have ``{seconds}``, its time limit.  It runs without a shell, and is ended with its children at the
limit; a plan that is written by then counts.
"""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.library.instance import Instance
from benchmarks.library.judge import bare, read_plan_text, verdict
from ppg_env.errors import InputError, require

OURS = ("social", "potential", "nash", "straight")
GRACE = 2.0
"""Seconds after its time limit at which a command is ended."""


@dataclass
class Outcome:
    """What a solver did with a game.

    Attributes
    ----------
    status : ``accepted``, ``refused``, ``no plan`` or ``failed``.
    said : the first defect, or what the solver said.
    plan : the accepted plan.
    social_cost, bound, epsilon : its cost; what the solver proved, if anything.
    seconds : CPU seconds of the solver.
    """

    status: str
    said: str = ""
    plan: dict[str, Any] | None = None
    social_cost: float | None = None
    bound: float | None = None
    epsilon: float | None = None
    seconds: float = 0.0
    values: dict[str, Any] = field(default_factory=dict)


def check_solver_name(solver: str) -> None:
    """Refuse a solver that is neither one of :data:`OURS` nor a command with both placeholders.

    Raises
    ------
    InputError
        With what to write instead.
    """
    command = "{game}" in solver and "{plan}" in solver
    require(
        solver in OURS or command,
        f"{solver!r:.80}",
        "is not a solver",
        f"write {', '.join(OURS)}, or a command such as 'python mine.py {{game}} {{plan}}'",
    )
    try:
        shlex.split(solver)
    except ValueError as error:
        raise InputError(f"{solver!r:.80}", f"is no command ({error})", "close quotes") from None


def solve(instance: Instance, solver: str, limit: float, node_limit: int | None = None) -> Outcome:
    """Run ``solver`` on a game within its limits, and check its plan.

    ``node_limit`` is for our joint searches: unlike seconds, it does not depend on the machine.
    """
    own = solver in OURS
    started = time.process_time() if own else _children()
    if own:
        plan, outcome = _ours(instance, solver, limit, node_limit)
    else:
        plan, outcome = _command(instance, solver, limit)
    outcome.seconds = round((time.process_time() if own else _children()) - started, 4)
    if plan is None:
        return outcome
    answer = verdict(instance, plan)
    if not answer["accepted"]:
        return Outcome("refused", answer["defects"][0], seconds=outcome.seconds)
    outcome.plan, outcome.social_cost = bare(plan), float(answer["social_cost"])
    return outcome


def _ours(
    instance: Instance, solver: str, limit: float, node_limit: int | None
) -> tuple[Any, Outcome]:
    from benchmarks.comparison.players import PLAYERS
    from solvers.planner_options import PlannerOptions
    from solvers.solution import Solution

    accepts = PLAYERS[solver].accepts
    options = PlannerOptions(time_limit=limit, node_limit=node_limit).only(accepts)
    solution = PLAYERS[solver].create(instance.game, options)
    assert isinstance(solution, Solution)
    outcome = Outcome("no plan", solution.advice)
    if solution.minimised == "social_cost" and np.isfinite(solution.bound):
        outcome.bound = float(solution.bound)
    if solution.profile is None or any(plan.arrival is None for plan in solution.profile):
        return None, outcome
    if solution.regret is not None and np.isfinite(solution.regret).all():
        outcome.epsilon = float(solution.regret.max())
        if len(solution.regret) == 1 and solution.evaluation is not None:  # a proof of optimality
            outcome.bound = solution.evaluation.social_cost - outcome.epsilon
    outcome.status = "accepted"
    plan = {
        "arrival": [plan.arrival for plan in solution.profile],
        "controls": [plan.controls.tolist() for plan in solution.profile],
    }
    return plan, outcome


def _command(instance: Instance, solver: str, limit: float) -> tuple[Any, Outcome]:
    with tempfile.TemporaryDirectory(prefix="ppg-library-") as folder:
        path = Path(folder) / "plan.json"
        places = {"{game}": str(instance.path), "{plan}": str(path), "{seconds}": f"{limit:g}"}
        words = []
        for word in shlex.split(solver):
            for mark, value in places.items():
                word = word.replace(mark, value)
            words.append(word)
        said = _run(words, limit)
        if not path.exists():
            return None, Outcome("failed" if said else "no plan", said or "wrote no plan")
        try:
            return read_plan_text(path), Outcome("accepted", said)
        except InputError as error:
            return None, Outcome("refused", str(error))


def _run(words: list[str], limit: float) -> str:
    """Run a command; return why it failed, if it did."""
    try:
        process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    except OSError as error:
        raise InputError(f"{words[0]!r}", f"cannot be run ({error.strerror})", "check it") from None
    try:
        _, errors = process.communicate(timeout=limit + GRACE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return "ended at the time limit"
    tail = errors.decode("utf-8", "replace").strip().splitlines()[-1:]
    return f"exit code {process.returncode}: {' '.join(tail)}"[:200] if process.returncode else ""


def _children() -> float:
    spent = os.times()
    return spent.children_user + spent.children_system
