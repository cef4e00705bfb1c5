"""``ppg explain``: columns of tables, methods, fields of a game, and the players."""

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
    "crash": "Two agents, or an agent and an obstacle, overlap: at the time steps where the game "
    "has collisions = instants, during the steps where it has swept; see ppg explain game.",
    "on schedule": "Each agent follows its plan with its feedback gain and leaves, or is parked, "
    "at its planned arrival time; inputs are not limited, crashed agents go on.",
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
        "own means collide at the times that count.",
        "regret <=": "Largest proved gain of an agent that changes its plan alone.",
        "crash probability": "Probability that any agent crashes, with its interval; for learners "
        "over training runs, where crashes are counted.",
        "risk bound": "Union bound on the crash probability, from the capped margins.",
        "between steps": "Where collisions = instants, the deepest place at which the means of a "
        "plan pass through something between two time steps, which no other number counts.",
        "expected cost": "Mean over agents of lam T + (1 - lam) kappa Pr(crash), with kappa the "
        "crash cost; ± half the interval.",
        **SHARED,
    },
    "risk": {
        "bound": "Certified upper bounds: the paper's, which caps margins; its ratio to the "
        "tightest; best faces without the cap; exact instants summed; less what successive "
        "instants share.  For overlaps during steps: half-spaces that cover them; the sum that "
        "programs minimise; less what successive half-spaces share.",
        "exact": "Exact for each instant; over time at most the tightest bound, at least a lower "
        "bound from single and joint probabilities.  Not for overlaps during steps.",
        "likeliest crash": "With --explain: the likeliest overlap, its reliability index beta (the "
        "norm of the least noise that causes it), the first-order estimate Phi(-beta) of its "
        "probability, and the deviations and noise of that path at each time.",
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
        "regret from": "What the agent gains by the best deviation found, in its expected cost; "
        "the others play on unchanged. An estimate of a lower bound: a better deviation may exist.",
        "to": "Upper bound: the upper limit of the agent's expected cost, less a proved bound on "
        "what it costs at least if it were alone.",
        "gain grid": "Gain of the best response by dynamic programming on a grid of the joint "
        "state, for games whose joint state has at most four dimensions.",
        "gain trained": "Gain of a deviation trained by PPO against the frozen others.",
        "gain planned": "Gain of the planner's best response to the others' mean behaviour.",
        "deviation": "The best deviation, chosen on other episodes than it is evaluated on; none "
        "if none gains.",
        **SHARED,
    },
    "feedback": {
        "grid value": "Expected cost by dynamic programming on the grid: an estimate, never a "
        "bound.",
        "expected cost": "Mean cost of the policies in simulated episodes: what counts.",
        "no players have less": "Proved lower bound on the mean of all agents' expected costs, "
        "whatever the players do and see.",
        "gain of a best response": "What the agent saves by a best response that is computed on a "
        "finer grid, simulated with the same noise: a lower bound on its regret; "
        "negative if its own policy is the better one.",
        **SHARED,
    },
    "game": {
        "collisions": "instants: bodies must keep apart at the time steps only, as in the paper; "
        "solve, certify, compare, equilibria and render report where means pass through something "
        "in between. swept: also on the straight lines between time steps; margins, deficits, risk "
        "bounds and crash probabilities then count steps. Scenarios have instants, game files "
        "swept unless they say otherwise.",
        "on_goal": "remove: an agent leaves when it arrives, as in the paper. stay: it is parked "
        "there and in the way; a pair counts until both are parked, in margins, deficits, costs, "
        "risk bounds and crash probabilities.",
        "within": "Sets in which an agent's mean stays up to its arrival, sigmas standard "
        "deviations clear of their faces: a workspace, or limits on the speed. They exclude plans, "
        "so arrivals and costs may grow; leaving them has no cost and is no crash.",
        "reserve": "Standard deviations z of the feedback for which nominal controls leave room in "
        "the control set, a'u + z sigma(a'K e) <= b. Plans may be slower and cost more; "
        "played inputs leave the set, or are clipped, less often.",
        "effort": "Weight w of the sum of |u|_1 in the agent's own cost. It changes cost, shifted "
        "and social cost, potential and regret; the expected cost of ppg compare leaves it out.",
        "between_steps": "In --json, the places where the means of a plan overlap between two time "
        "steps: the deepest for each pair, after which share of the step (moment), and how deep.",
    },
}
"""Terms of each topic; all topics but ``game`` are commands."""


def explain(
    topic: Annotated[str, typer.Argument(metavar="|".join(TOPICS), help="What to explain.")],
    as_json: JsonOption = False,
) -> None:
    """Explain the tables of a command, with the players, or the fields of a game."""
    from ppg_env.errors import require

    require(topic in TOPICS, "TOPIC", f"is {topic!r}", "write " + " or ".join(TOPICS))
    terms, players = TOPICS[topic], _players()
    if as_json:
        print_json({"topic": topic, "terms": terms, "players": players})
        return
    if topic == "game":
        print_table("Fields of a game", ("field", "meaning"), list(terms.items()), texts=2)
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
