"""``ppg explain``: what the columns of tables mean, and what players there are."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from benchmarks.options import JsonOption
from benchmarks.terminal import print_json, print_table

SHARED = {
    "95 % intervals": "Clopper-Pearson for counted crashes; normal or Student's intervals for "
    "means, for rare events and over training runs. Limits are rounded outward.",
    "rare events": "Fewer than ten counted crashes are estimated by importance sampling on "
    "schedule (episodes weighted, a crash in sight) and by splitting in the environment.",
    "not to be trusted": "The effective sample is too small: the upper limit is one that can be "
    "proved; ask for more episodes.",
    "crash": "Two agents, or an agent and an obstacle, overlap.",
    "on schedule": "Each agent follows its plan with its feedback gain and leaves at its planned "
    "arrival time; inputs are not limited, crashed agents go on.",
    "in the environment": "Agents arrive within a region, inputs are projected on the control "
    "set, crashed agents leave.",
}

TOPICS: dict[str, dict[str, str]] = {
    "compare": {
        "sees": "Information used while playing: open loop (the clock), own state, or full state.",
        "runs": "Independent trainings of a learner.",
        "arrival": "Arrival time of each agent; in the environment the mean over the episodes in "
        "which it arrives.",
        "arrived %": "Share of episodes in which each agent arrives.",
        "social cost": "Sum of the agents' shifted costs, by the evaluator; overlap: the plan's "
        "own means collide.",
        "regret <=": "Largest proved gain of an agent that changes its plan alone.",
        "crash probability": "Probability that any agent crashes, with its interval; for learners "
        "over training runs, where crashes are counted.",
        "risk bound": "Union bound on the crash probability, from the capped margins.",
        "expected cost": "Mean over agents of lam T + (1 - lam) kappa Pr(crash), with kappa the "
        "crash cost; ± half the interval.",
        **SHARED,
    },
    "risk": {
        "bound": "Certified upper bounds: the paper's, which caps margins; its ratio to the "
        "tightest; best faces without the cap; exact instants summed; less what successive "
        "instants share.  For overlaps during steps: half-spaces that cover them; the sum that "
        "programs minimise; less what successive half-spaces share.",
        "exact": "Exact for each instant; over time at most the tightest bound, at least the "
        "likeliest instant.  Not for overlaps during steps.",
        "mc": "Episodes are simulated and crashes counted, with whom and when first.",
        "rare": "Crashes too rare to be counted: episodes on schedule drawn with a crash in sight "
        "and weighted; in the environment splitting by levels.",
        "std. error": "Standard error of the estimate.",
        "worth samples": "Equally weighted episodes with a crash that carry the same information.",
        "between instants": "Crashes on the straight lines between instants that no instant "
        "shows; where overlaps during steps count, or with --swept.",
        "difference": "Probability of the plan --against minus that of this plan, in the same "
        "noise.",
        **SHARED,
    },
    "regret": {
        "regret from": "Lower bound on what the agent gains by the best deviation found, in its "
        "expected cost; the others play on unchanged.",
        "gain trained": "Gain of a deviation trained by PPO against the frozen others.",
        "gain planned": "Gain of the planner's best response to the others' mean behaviour.",
        "deviation": "The better deviation, chosen on other episodes than it is evaluated on; none "
        "if neither gains.",
        **SHARED,
    },
}


def explain(
    topic: Annotated[str, typer.Argument(metavar="|".join(TOPICS), help="What to explain.")],
    as_json: JsonOption = False,
) -> None:
    """Explain the columns and methods of a command's tables, and list the players."""
    from ppg_env.errors import require

    require(topic in TOPICS, "TOPIC", f"is {topic!r}", "write " + " or ".join(TOPICS))
    terms, players = TOPICS[topic], _players()
    if as_json:
        print_json({"topic": topic, "terms": terms, "players": players})
        return
    print_table(f"ppg {topic}", ("term", "meaning"), list(terms.items()), texts=2)
    rows = [
        (row["name"], row["arena"], row["information"], " ".join(row["accepts"])) for row in players
    ]
    print_table("Players", ("player", "needs", "sees", "accepts"), rows, texts=4)


def _players() -> list[dict[str, Any]]:
    from benchmarks.comparison.players import PLAYERS

    names = ("name", "arena", "information", "accepts")
    return [{name: getattr(player, name) for name in names} for player in PLAYERS.values()]
