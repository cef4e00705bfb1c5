"""Runs of a solver over many games: one JSON line per game, so that a stopped run continues.

A line is reused if game, digest, solver and limit are the same.  Lines have no plans: those go into
the records (``--submit``), or into files next to the lines.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

from benchmarks.library.instance import Instance
from benchmarks.library.judge import risk_limits
from benchmarks.library.provenance import provenance
from benchmarks.library.record import CERTIFIED, write_record
from benchmarks.library.solver_run import OURS, Outcome, solve
from ppg_env.errors import InputError
from ppg_env.support.atomic_write import write_atomically
from ppg_env.support.read_file import read_text

RUNS = Path(__file__).parent / "runs"
"""Lines of this project's solvers, which reports compare with."""

REQUIRED = ("game", "digest", "label", "status", "social_cost")

Line = dict[str, Any]


@dataclass(frozen=True)
class RunPlan:
    """What to run, and where to.

    Attributes
    ----------
    solver, label : the solver, and its name in rankings.
    limit : seconds for each game.
    node_limit : linear programs for each game, for our joint searches; None is no limit.
    path : file of lines.
    plans : folder of accepted plans; None keeps none.
    submit : whether better plans and bounds go into the records.
    """

    solver: str
    label: str
    limit: float
    node_limit: int | None
    path: Path
    plans: Path | None = None
    submit: bool = False


def read_lines(path: Path) -> list[Line]:
    """Return the lines of a run, the last one of each game; a line that was cut off is ignored.

    Raises
    ------
    InputError
        If the file is not one of runs.
    """
    lines: dict[str, Line] = {}
    whole = read_text(path).split("\n")[:-1]
    try:
        for text in whole:
            line = json.loads(text)
            lines[line["game"]] = {key: line[key] for key in REQUIRED} | line
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(
            str(path),
            f"is no file of runs ({type(error).__name__}: {error!s:.200})",
            "name one that ppg library run wrote",
        ) from None
    return list(lines.values())


def _append(path: Path, line: Line) -> None:
    """Append a line, in place of one that was cut off by a kill or a full disk.

    Raises
    ------
    InputError
        If the file cannot be written; earlier lines are kept.
    """
    try:
        with path.open("ab+") as file:
            file.seek(0)
            file.truncate(file.read().rfind(b"\n") + 1)
            file.write(json.dumps(line, allow_nan=False).encode() + b"\n")
    except OSError as error:
        raise InputError(
            str(path), f"cannot be written ({error.strerror})", "free some space, and run again"
        ) from None


def run(plan: RunPlan, games: Sequence[Instance], budget: float | None = None) -> Iterator[Line]:
    """Run the games that have no line yet, the smallest first, and yield each new line.

    No game is started after ``budget`` seconds.
    """
    ended = {_address(line) for line in read_lines(plan.path)} if plan.path.exists() else set()
    started = monotonic()
    for instance in sorted(games, key=_size):
        address = (instance.name, instance.digest, plan.solver, plan.limit, plan.node_limit)
        if address in ended:
            continue
        if budget is not None and monotonic() - started > budget:
            return
        line = _run_one(plan, instance)
        _append(plan.path, line)
        yield line


def _size(instance: Instance) -> int:
    """Return the number of encounters and horizon, multiplied: small games are solved faster."""
    agents, obstacles = (len(instance.tables.get(key, ())) for key in ("agent", "obstacle"))
    encounters = agents * (agents - 1) // 2 + agents * obstacles
    states = max(len(agent["start"]) for agent in instance.tables["agent"])
    return int(instance.tables["game"]["horizon"]) * max(encounters, 1) * states


def _address(line: Line) -> tuple[Any, ...]:
    return (
        line["game"],
        line["digest"],
        *(line.get(key) for key in ("solver", "limit", "node_limit")),
    )


def _run_one(plan: RunPlan, instance: Instance) -> Line:
    try:
        outcome = solve(instance, plan.solver, plan.limit, plan.node_limit)
    except InputError:
        raise
    except Exception as error:  # a failing solver is a line
        outcome = Outcome("failed", f"{type(error).__name__}: {error}"[:200])
    improves = _offer(plan, instance, outcome) if plan.submit else []
    if plan.plans is not None and outcome.plan is not None:
        path = plan.plans / f"{instance.path.parent.name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, json.dumps(outcome.plan))
    return {
        "game": instance.name,
        "digest": instance.digest,
        "label": plan.label,
        "solver": plan.solver,
        "limit": plan.limit,
        "node_limit": plan.node_limit,
        "status": outcome.status,
        "said": outcome.said,
        "social_cost": outcome.social_cost,
        "bound": outcome.bound,
        "epsilon": outcome.epsilon,
        "seconds": outcome.seconds,
        "improves": improves,
        **{key: provenance(plan.label)[key] for key in ("date", "machine")},
    }


def _offer(plan: RunPlan, instance: Instance, outcome: Outcome) -> list[str]:
    """Put what the solver found and proved into the record; return what it improves."""
    command = f"ppg library run {plan.solver} --time-limit {plan.limit:g}"
    command += f" --node-limit {plan.node_limit}" if plan.node_limit else ""
    by = f"ppg {plan.solver}" if plan.solver in OURS else plan.label
    origin = provenance(by, command, outcome.seconds)
    record, improves = instance.record, []
    if outcome.plan is not None and outcome.social_cost is not None:
        cost = outcome.social_cost
        if record.offer_plan(cost, outcome.plan, origin):
            improves.append("social")
            record.risk["social"] = risk_limits(instance, outcome.plan)
        epsilon = outcome.epsilon
        certified = plan.solver in OURS and epsilon is not None and epsilon <= CERTIFIED
        if certified and record.offer_equilibrium(cost, epsilon or 0.0, outcome.plan, origin):
            improves.append("equilibrium")
    if outcome.bound is not None and record.offer_bound(outcome.bound, origin):
        improves.append("bound")
    if improves:
        write_record(instance.record_path, record)
    return improves
