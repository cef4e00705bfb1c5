r"""Crash probabilities from simulation, for ``ppg risk``.

mc      Clopper-Pearson intervals from plain episodes; differences from the same episodes
rare    on schedule: importance sampling with a crash in sight; in the environment: splitting
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from baselines.evaluate_runs import OF_A_LEVEL, evaluate_rare_runs, evaluate_runs
from benchmarks.comparison.players import REPLANNING
from benchmarks.crash_risk.details import (
    chance,
    counts_report,
    estimate_report,
    rare_report,
    when,
    whom,
)
from benchmarks.crash_risk.query import RiskQuery, RiskReport
from benchmarks.terminal import interval
from ppg_env.env.players import Player, track
from ppg_env.errors import InputError, require
from ppg_env.risk.crash_events import is_swept
from ppg_env.risk.importance_sampling import IN_SIGHT, rare_risk
from ppg_env.risk.monte_carlo import crash_counts, paired_counts

if TYPE_CHECKING:
    from ppg_env.risk.monte_carlo import PairedCounts
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
        {"arena": "schedule", **counts_report(game, counts)},
        {"mostly with": whom(game, counts), "mostly at": when(game, counts)},
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
    details = {"arena": query.arena, **rare_report(query.game, risk)}
    if risk.between is not None:
        added = [*risk.between.agents, risk.between.any]
        columns["between instants"] = [str(chance(event)) for event in added]
        details["between"] = rare_report(query.game, risk.between)
    doubts = sorted({event.advice for event in events if not event.trusted})
    if doubts:
        promise = f"not to be trusted: {'; '.join(doubts)}.\n{promise}"
    return _risk_report(promise, risk.agents, risk.any, risk.samples, details, columns)


def _split(query: RiskQuery) -> tuple[RareRisk, str]:
    """Split episodes in the environment by levels."""
    if query.entrant is not None and query.entrant.name in REPLANNING:
        problem = f"is {query.entrant.name}, whose plans of earlier steps cannot be split"
        raise InputError("--player", problem, "add --method mc")
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
            query.swept == is_swept(query.game),
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
        **counts_report(game, counts),
        "instants": counts_report(game, pair.first),
        "between": [estimate_report(event) for event in added],
    }
    columns = {
        "mostly with": whom(game, counts),
        "mostly at": when(game, counts),
        "between instants": [str(chance(event)) for event in added],
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
        "against": {
            "agents": [estimate_report(event) for event in others],
            "any": estimate_report(other),
        },
        "difference": {
            "agents": [vars(event) for event in more],
            "any": vars(more_any),
            "only_this": pair.only_first,
            "only_against": pair.only_second,
        },
    }
    columns = {
        "against": [str(chance(event)) for event in (*others, other)],
        "difference": [interval(event, "+.1e", "+.1e") for event in differences],
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
        tuple(map(chance, agents)),
        chance(of_any),
        samples,
        details,
        tuple(columns),
        tuple(zip(*columns.values(), strict=True)) or None,
    )
