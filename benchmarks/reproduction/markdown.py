"""Stored verdicts in Markdown, for the documentation."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.studies.markdown import markdown_table


def told(path: Path) -> str:
    """Table and definitions of the claims in ``path``, as ``ppg reproduce --json`` wrote them."""
    stored = json.loads(path.read_text(encoding="utf-8"))
    claims = stored["claims"]
    lines = [
        (
            f"**{one['key']}**",
            one["text"],
            one["source"],
            one["verdict"],
            f"{one['holding']}/{one['total']}",
        )
        for one in claims
    ]
    table = markdown_table(("claim", "what the paper says", "where", "verdict", "cases"), lines)
    made = (
        f"{len(stored['panels'])} figure rows, {len(stored['lam'])} values of lam, "
        f"{stored['episodes']:,} episodes of each plan, seed {stored['seed']}."
    )
    holds = "\n".join(f"- *{one['key']}*: {one['definition']}." for one in claims)
    return f"{table}\n\n{made}\n\nIn each case, a claim holds if\n\n{holds}\n"
