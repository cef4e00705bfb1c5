"""Stored verdicts as Markdown, for the documentation: of one run, or of two rules compared."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.studies.markdown import markdown_table
from ppg_env.errors import require
from ppg_env.game.between_steps import OVERLAP_TIMES


def claims_markdown(path: Path) -> str:
    """Return a table and the definitions of the claims that ``ppg reproduce --json`` wrote."""
    stored = _stored(path)
    claims = stored["claims"]
    lines = [
        (
            f"**{claim['key']}**",
            claim["text"],
            claim["source"],
            claim["verdict"],
            f"{claim['holding']}/{claim['total']}",
        )
        for claim in claims
    ]
    table = markdown_table(("claim", "what the paper says", "where", "verdict", "cases"), lines)
    extent = f"{_extent(stored)} A crash is an overlap {OVERLAP_TIMES[_rule(stored)]}."
    holds = "\n".join(f"- *{claim['key']}*: {claim['definition']}." for claim in claims)
    return f"{table}\n\n{extent}\n\nIn a case, a claim holds if\n\n{holds}\n"


def compared_markdown(first: Path, second: Path) -> str:
    """Return the verdicts of two runs of the same extent, next to each other.

    Cases are those of both runs: an equilibrium without a plan under one rule is left out.

    Raises
    ------
    InputError
        If the two runs differ in more than the rule of collisions.
    """
    one, two = _stored(first), _stored(second)
    same = all(one[key] == two[key] for key in ("episodes", "seed", "lam"))
    require(same, str(second), f"has another extent than {first}", "run both with equal options")
    lines, changed = [], []
    for before, after in zip(one["claims"], two["claims"], strict=True):
        was, now = _outcomes(before), _outcomes(after)
        gained = sum(now[case] and not was[case] for case in was.keys() & now.keys())
        lost = sum(was[case] and not now[case] for case in was.keys() & now.keys())
        if before["word"] != after["word"]:
            changed.append(f"{before['key']} ({before['word']}, {after['word']})")
        lines.append(
            (f"**{before['key']}**", _brief(before), _brief(after), str(gained), str(lost))
        )
    rules = [_rule(stored) for stored in (one, two)]
    heads = ("claim", *rules, "newly holds", "no longer holds")
    crashes = ", ".join(f"{OVERLAP_TIMES[rule]} ({rule})" for rule in rules)
    said = ", ".join(changed) if changed else "none"
    return (
        f"{markdown_table(heads, lines, texts=3)}\n\nClaims with another verdict: {said}.\n\n"
        f"{_extent(one)} A crash is an overlap {crashes}.\n"
    )


def _outcomes(claim: Mapping[str, Any]) -> dict[tuple[str, ...], bool]:
    """Return whether the claim holds in each case, by the values of the case's factors."""
    kept = ("holds", "evidence")
    return {
        tuple(f"{name}={value}" for name, value in case.items() if name not in kept): case["holds"]
        for case in claim["cases"]
    }


def _brief(claim: Mapping[str, Any]) -> str:
    return f"{claim['word']}, {claim['holding']}/{claim['total']}"


def _stored(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def _rule(stored: Mapping[str, Any]) -> str:
    return str(stored.get("collisions", "instants"))


def _extent(stored: Mapping[str, Any]) -> str:
    return (
        f"{len(stored['panels'])} figure rows, {len(stored['lam'])} values of lam, "
        f"{stored['episodes']:,} episodes of each plan, seed {stored['seed']}."
    )
