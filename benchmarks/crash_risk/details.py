"""Details of simulated crashes: per encounter, with whom, and when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.crash_risk.query import Chance, parties
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.margins import membership

if TYPE_CHECKING:
    from ppg_env.risk.monte_carlo import CrashCounts
    from ppg_env.support.statistics import Estimate, RareEstimate, RareRisk


def chance(estimate: Estimate | RareEstimate) -> Chance:
    """Return an estimate as a chance."""
    return Chance(estimate.value, estimate.low, estimate.high)


def estimate_report(estimate: Estimate) -> dict[str, float]:
    """Return a counted probability with its limits and hits."""
    return vars(chance(estimate)) | {"hits": estimate.hits}


def whom(game: Game, counts: CrashCounts) -> list[str]:
    """Return with whom each agent crashes most often, and the most frequent pair."""
    listed = list(zip(counts.encounters, game.encounters, strict=True))

    def mostly(own: list[tuple[int, Encounter]], name: str | None) -> str:
        hits, encounter = max(own, key=lambda pair: pair[0], default=(0, None))
        if not hits or encounter is None:
            return ""
        return " and ".join(other for other in parties(game, encounter) if other != name)

    each = [
        mostly([(hits, e) for hits, e in listed if i in e.agents], name)
        for i, name in enumerate(game.agent_names)
    ]
    return [*each, mostly(listed, None)]


def when(game: Game, counts: CrashCounts) -> list[str]:
    """Return the most frequent time of each agent's first crash, and of any first crash."""
    own = membership(game)
    rows = [*(counts.first_times[chosen].sum(axis=0) for chosen in own), counts.first_any]
    return [f"t = {row.argmax()}" if row.any() else "" for row in rows]


def counts_report(game: Game, counts: CrashCounts) -> dict[str, Any]:
    """Return every encounter with its crashes per time: all, and first ones."""
    encounters = [
        {**_place(encounter), **estimate_report(event), "times": times, "first_times": first}
        for encounter, event, times, first in zip(
            game.encounters,
            counts.each(counts.encounters),
            counts.times,
            counts.first_times,
            strict=True,
        )
    ]
    return {"encounters": encounters, "first_any": counts.first_any, "hits_any": counts.any}


def rare_report(game: Game, risk: RareRisk) -> dict[str, Any]:
    """Return the estimates of each agent, of any agent, and of every encounter."""
    encounters = [
        {**_place(encounter), **vars(event)}
        for encounter, event in zip(game.encounters, risk.encounters, strict=True)
    ]
    each = [vars(event) for event in risk.agents]
    return {"agents": each, "any": vars(risk.any), "encounters": encounters}


def _place(encounter: Encounter) -> dict[str, Any]:
    return {"agents": encounter.agents, "obstacle": encounter.obstacle}
