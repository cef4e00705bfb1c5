r"""Crash probabilities from simulation, for ``ppg risk``.

mc      Clopper-Pearson intervals from plain episodes; differences from the same episodes
rare    on schedule: importance sampling with a crash in sight; in the environment: splitting
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from baselines.evaluate_runs import OF_A_LEVEL, evaluate_rare_runs, evaluate_runs
from benchmarks.comparison.players import RECEDING
from benchmarks.crash_risk.query import Chance, RiskQuery, RiskReport, parties
from benchmarks.terminal import interval
from ppg_env.env.players import Player, track
from ppg_env.errors import InputError, require
from ppg_env.game.game import Encounter, Game
from ppg_env.game.margins import membership
from ppg_env.risk.importance_sampling import IN_SIGHT, rare_risk
from ppg_env.risk.monte_carlo import crash_counts, paired_counts

if TYPE_CHECKING:
    from ppg_env.risk.monte_carlo import CrashCounts, PairedCounts
    from ppg_env.support.statistics import Estimate, RareEstimate, RareRisk

PLAIN = 1_000_000
"""Default number of counted episodes."""


def mc(query: RiskQuery) -> RiskReport:
    """Count crashes in plain episodes."""
    _check(query)
    game, samples = query.game, query.episodes or PLAIN
    if query.arena == "env":
        summary = evaluate_runs(game, _runs(query), samples, query.planner.seed).summary
        promise, details = f"{samples:,} episodes in the environment", {"arena": "env"}
        return _risk_report(promise, summary.crash, summary.crash_any, samples, details)
    assert query.profile is not None
    own, request = (game, query.profile), (samples, query.planner.seed)
    tools: dict[str, Any] = {"workers": query.workers, "progress": query.progress}
    if query.against is not None:
        looks = (query.swept, query.swept)
        pair = paired_counts(own, query.against, *request, swept=looks, **tools)
        return _difference(query, pair)
    if query.swept:
        return _swept(query, paired_counts(own, own, *request, swept=(False, True), **tools))
    counts = crash_counts(*own, *request, **tools)
    each, of_any = counts.estimates()
    return _risk_report(
        f"{samples:,} episodes on schedule; with whom and when first",
        each,
        of_any,
        samples,
        {"arena": "schedule", **_counts_report(game, counts)},
        {"mostly with": _whom(game, counts), "mostly at": _when(game, counts)},
    )


def rare(query: RiskQuery) -> RiskReport:
    """Estimate crashes that are too rare to be counted."""
    _check(query)
    require(query.against is None, "--against", "is for mc", "add --method mc")
    if query.arena == "env":
        risk, promise = _split(query)
    else:
        risk, promise = _sampled(query)
    events = [*risk.agents, risk.any]
    columns = {
        "std. error": [f"{event.standard_error:.1e}" for event in events],
        "worth samples": [f"{event.effective_samples:,.0f}" for event in events],
    }
    details = {"arena": query.arena, **_rare_report(query.game, risk)}
    if risk.between is not None:
        added = [*risk.between.agents, risk.between.any]
        columns["between instants"] = [str(_chance(event)) for event in added]
        details["between"] = _rare_report(query.game, risk.between)
    doubts = sorted({event.advice for event in events if not event.trusted})
    if doubts:
        promise = f"not to be trusted: {'; '.join(doubts)}.\n{promise}"
    return _risk_report(promise, risk.agents, risk.any, risk.samples, details, columns)


def _split(query: RiskQuery) -> tuple[RareRisk, str]:
    """Split episodes in the environment by levels."""
    if query.entrant is not None and query.entrant.name == RECEDING:
        raise InputError(
            "--player", "is receding, which plans too slowly for splitting", "add --method mc"
        )
    risk = evaluate_rare_runs(
        query.game,
        _runs(query),
        query.episodes or OF_A_LEVEL,
        query.planner.seed,
        progress=query.progress,
    )
    return risk, f"{risk.samples:,} episodes in the environment, split by levels"


def _sampled(query: RiskQuery) -> tuple[RareRisk, str]:
    """Draw weighted episodes on schedule with a crash in sight."""
    assert query.profile is not None
    risk = rare_risk(
        query.game,
        query.profile,
        query.episodes or IN_SIGHT,
        query.planner.seed,
        swept=query.swept,
        workers=query.workers,
        progress=query.progress,
    )
    return risk, f"{risk.samples:,} weighted episodes on schedule, drawn with a crash in sight"


def _check(query: RiskQuery) -> None:
    if query.arena == "env":
        require(
            not query.swept,
            "--swept",
            "is for plans on schedule",
            "leave it out in the environment",
        )
        require(query.against is None, "--against", "is for plans on schedule", "leave it out")


def _runs(query: RiskQuery) -> Sequence[Sequence[Player]]:
    """Return the players in the environment, for each training."""
    if query.entrant is not None:
        return query.entrant.policies(query.game, query.planner)
    assert query.profile is not None
    return [track(query.game, query.profile)]


def _swept(query: RiskQuery, pair: PairedCounts) -> RiskReport:
    """Report crashes on the lines between instants, and how many of them no instant shows."""
    game, counts = query.game, pair.second
    each, of_any = counts.estimates()
    added = counts.each(pair.only_second)
    details = {
        "arena": "schedule",
        **_counts_report(game, counts),
        "instants": _counts_report(game, pair.first),
        "between": [_report(one) for one in added],
    }
    columns = {
        "mostly with": _whom(game, counts),
        "mostly at": _when(game, counts),
        "between instants": [str(_chance(one)) for one in added],
    }
    promise = f"{counts.samples:,} episodes on schedule, on straight lines between the instants"
    return _risk_report(promise, each, of_any, counts.samples, details, columns)


def _difference(query: RiskQuery, pair: PairedCounts) -> RiskReport:
    """Report the plan's own probabilities, and the difference of the other plan's."""
    each, of_any = pair.first.estimates()
    others, other = pair.second.estimates()
    more, more_any = pair.differences()
    differences = [*more, more_any]
    details = {
        "arena": "schedule",
        "against": {"agents": [_report(one) for one in others], "any": _report(other)},
        "difference": {
            "agents": [vars(one) for one in more],
            "any": vars(more_any),
            "only_this": pair.only_first,
            "only_against": pair.only_second,
        },
    }
    columns = {
        "against": [str(_chance(one)) for one in (*others, other)],
        "difference": [interval(one, "+.1e", "+.1e") for one in differences],
    }
    samples = pair.first.samples
    promise = f"the same {samples:,} episodes on schedule for both; difference: against less this"
    return _risk_report(promise, each, of_any, samples, details, columns)


def _risk_report(
    promise: str,
    agents: Sequence[Estimate | RareEstimate],
    of_any: Estimate | RareEstimate,
    samples: int,
    details: dict[str, Any],
    columns: dict[str, list[str]] | None = None,
) -> RiskReport:
    """Return a report; further columns have one cell per agent, and one for any agent."""
    columns = columns or {}
    return RiskReport(
        f"{promise[0].upper()}{promise[1:]}; 95 % intervals; see ppg explain risk.",
        tuple(map(_chance, agents)),
        _chance(of_any),
        samples,
        details,
        tuple(columns),
        tuple(zip(*columns.values(), strict=True)) or None,
    )


def _chance(estimate: Estimate | RareEstimate) -> Chance:
    return Chance(estimate.value, estimate.low, estimate.high)


def _report(estimate: Estimate) -> dict[str, float]:
    return vars(_chance(estimate)) | {"hits": estimate.hits}


def _whom(game: Game, counts: CrashCounts) -> list[str]:
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


def _when(game: Game, counts: CrashCounts) -> list[str]:
    """Return the most frequent time of each agent's first crash, and of any first crash."""
    each = [counts.first_times[own].sum(axis=0) for own in membership(game)]
    rows = [*each, counts.first_any]
    return [f"t = {row.argmax()}" if row.any() else "" for row in rows]


def _counts_report(game: Game, counts: CrashCounts) -> dict[str, Any]:
    """Return every encounter with its crashes per time: all, and first ones."""
    encounters = [
        {**_place(encounter), **_report(one), "times": times, "first_times": first}
        for encounter, one, times, first in zip(
            game.encounters,
            counts.each(counts.encounters),
            counts.times,
            counts.first_times,
            strict=True,
        )
    ]
    return {"encounters": encounters, "first_any": counts.first_any, "hits_any": counts.any}


def _rare_report(game: Game, found: RareRisk) -> dict[str, Any]:
    encounters = [
        {**_place(encounter), **vars(one)}
        for encounter, one in zip(game.encounters, found.encounters, strict=True)
    ]
    each = [vars(one) for one in found.agents]
    return {"agents": each, "any": vars(found.any), "encounters": encounters}


def _place(encounter: Encounter) -> dict[str, Any]:
    return {"agents": encounter.agents, "obstacle": encounter.obstacle}
