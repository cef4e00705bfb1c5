r"""Players of a game in the environment: what they cost, how often they crash, and their regret.

Agents arrive within the default region, and inputs are projected on their control sets.  The entry
of a player in a record:

    sees        what it observes: open loop, own state, or full state
    cost        mean over agents of lam per step, effort, and (1 - lam) kappa for a crash; limits
    crash       probability that any agent crashes; limits
    arrived     share of the agents that arrive
    episodes, seed, runs    of the simulation; runs are independent trainings
    plan_cost   social cost of the plan that it tracks
    regret      per agent, gain of the best deviation found and proved upper bound, of run 0
    deviations  kinds of deviations that were looked for

Limits hold with 95 %; those of several trainings cover the trainings, too.  Regrets are in units of
cost in the environment, not in those of plans.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import process_time
from typing import TYPE_CHECKING

from benchmarks.library.instance import Instance
from benchmarks.library.provenance import provenance
from benchmarks.library.record import Entry
from benchmarks.library.team import teams
from ppg_env.env.players import Player, information

if TYPE_CHECKING:
    from baselines.evaluate_runs import RunStatistics


def play(
    instance: Instance,
    name: str,
    episodes: int,
    *,
    by: str,
    seed: int = 0,
    deviations: Sequence[str] = (),
    limit: float | None = None,
) -> Entry | None:
    """Simulate a player, and return its entry; None if the game has no plan to track.

    Raises
    ------
    InputError
        If the game has no such player, or cannot be played in the environment.
    """
    started = process_time()
    runs = teams(instance, name, limit)
    if not runs:
        return None
    from baselines.evaluate_runs import evaluate_runs

    entry = _figures(evaluate_runs(instance.game, runs, episodes, seed))
    entry = {"sees": information(runs[0]), **entry, "seed": seed, "runs": len(runs)}
    plan = instance.record.tracked(name)
    if plan is not None:
        entry["plan_cost"] = plan["social_cost"]
    if deviations:
        entry |= _regret(instance, runs[0], deviations, episodes, seed, limit)
    command = f"ppg library play {instance.path.parent.name} --players {name}"
    command += f" --episodes {episodes} --seed {seed}"
    command += f" --deviation {','.join(deviations)}" if deviations else ""
    entry["provenance"] = provenance(by, command, process_time() - started)
    return entry


def _figures(statistics: RunStatistics) -> Entry:
    """Return costs and crashes; limits over runs contain those over episodes."""
    summary, several = statistics.summary, len(statistics.groups) > 1
    pairs = {"cost": (summary.cost_mean, "expected_cost")}
    pairs |= {"crash": (summary.crash_any, "crash_probability")}  # type: ignore[dict-item]
    entry: Entry = {}
    for name, (estimate, column) in pairs.items():
        low, high = estimate.low, estimate.high
        if several:
            spread = statistics.over_runs()[column]
            low, high = min(low, spread.low), max(high, spread.high)
        entry[name] = [round(float(x), 9) for x in (estimate.value, low, high)]
    entry["arrived"] = round(float(statistics.successes.mean()), 9)
    entry["episodes"] = sum(len(group.cost) for group in statistics.groups)
    return entry


def _regret(
    instance: Instance,
    players: Sequence[Player],
    deviations: Sequence[str],
    episodes: int,
    seed: int,
    limit: float | None,
) -> Entry:
    from baselines.deviations import DeviationOptions
    from baselines.regret import regret_bounds

    options = DeviationOptions(time_limit=limit, seed=seed)
    bounds = regret_bounds(
        instance.game,
        players,
        deviations=deviations,
        episodes=episodes,
        seed=seed,
        options=options,
    )
    pairs = [[round(b.regret.value, 6), round(b.most, 6)] for b in bounds.values()]
    return {"regret": pairs, "deviations": list(deviations)}


def is_current(
    instance: Instance, name: str, episodes: int, seed: int, deviations: Sequence[str] = ()
) -> bool:
    """Return whether the record has a simulation of this player, as long, of the same plan."""
    entry = instance.record.players.get(name)
    if entry is None or entry["seed"] != seed or entry["episodes"] < episodes:
        return False
    plan = instance.record.tracked(name)
    same = plan is None or entry.get("plan_cost") == plan["social_cost"]
    return same and set(deviations) <= set(entry.get("deviations", ()))
