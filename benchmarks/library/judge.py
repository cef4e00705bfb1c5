"""The checker's verdict on plans, recorded ones and submitted ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from benchmarks.library.checker import check
from benchmarks.library.instance import Instance
from benchmarks.library.provenance import provenance
from benchmarks.library.record import CERTIFIED, Entry, Record, write_record
from ppg_env.errors import InputError
from ppg_env.game.plan import Profile, make_profile
from ppg_env.support.read_file import read_text

Verdict = dict[str, Any]


def verdict(instance: Instance, plan: Any) -> Verdict:
    """Return the checker's answer; a plan that it cannot read is refused."""
    try:
        return check(instance.tables, plan)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        return {"accepted": False, "defects": [f"the plan cannot be read: {error!r}"]}


def read_plan_text(path: Path) -> Any:
    """Return the content of a plan file, which may be anything in JSON.

    Raises
    ------
    InputError
        If there is no such file, or it is not JSON.
    """
    text = read_text(path)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            str(path), f"cannot be read as JSON ({error})", "write arrival and controls, as in docs"
        ) from None


def bare(plan: Entry) -> Entry:
    """Return what a record keeps of a plan: arrivals, and controls that are zero after them."""
    rows = zip(plan["controls"], plan["arrival"], strict=True)
    controls = [
        [[float(x) if t < arrival else 0.0 for x in row] for t, row in enumerate(plan_rows)]
        for plan_rows, arrival in rows
    ]
    return {"arrival": list(plan["arrival"]), "controls": controls}


def profile_of(instance: Instance, plan: Entry) -> Profile:
    """Return the plan as a profile of the package."""
    return make_profile(instance.game, plan["controls"])


def submit(instance: Instance, plan: Any, by: str, *, certify: bool = False) -> Verdict:
    """Check a plan, and put it into the record if it is better; return the verdict.

    The verdict gets ``improves``, the entries that the plan replaces, and with ``certify`` also
    ``regret``, certified upper bounds.
    """
    answer = verdict(instance, plan)
    answer["improves"] = []
    if not answer["accepted"]:
        return answer
    record, origin = instance.record, provenance(by, "ppg library submit")
    kept, cost = bare(plan), float(answer["social_cost"])
    if record.offer_plan(cost, kept, origin):
        answer["improves"].append("social")
        record.risk["social"] = risk_limits(instance, kept)
    if certify:
        answer["regret"] = regrets(instance, kept)
        if max(answer["regret"]) <= CERTIFIED and record.offer_equilibrium(
            cost, max(answer["regret"]), kept, origin
        ):
            answer["improves"].append("equilibrium")
    if answer["improves"]:
        write_record(instance.record_path, record)
    return answer


def regrets(instance: Instance, plan: Entry) -> list[float]:
    """Return certified upper bounds on each agent's gain by a deviation."""
    from solvers.equilibrium.certificate import certify

    found = certify(instance.game, profile_of(instance, plan))
    return [float(regret) for regret in found.regret]


def risk_limits(instance: Instance, plan: Entry) -> list[float]:
    """Return proved limits of the probability of any crash, in the event of the game."""
    from ppg_env.risk.union_bounds import risk_bounds

    bounds = risk_bounds(instance.game, profile_of(instance, plan)).any
    return [float(bounds.least), float(bounds.tree)]


def recorded_plans(record: Record) -> dict[str, Entry]:
    """Return the entries of a record that have a plan, by what they are."""
    names = ("best equilibrium", "worst equilibrium")
    plans = {} if record.social is None else {"social": record.social}
    return plans | dict(zip(names, record.equilibria, strict=False))
