"""Stored verdicts as Markdown, for the documentation."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.studies.markdown import markdown_table


def claims_markdown(path: Path) -> str:
    """Return a table and the definitions of the claims that ``ppg reproduce --json`` wrote."""
    stored = json.loads(path.read_text(encoding="utf-8"))
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
    extent = (
        f"{len(stored['panels'])} figure rows, {len(stored['lam'])} values of lam, "
        f"{stored['episodes']:,} episodes of each plan, seed {stored['seed']}."
    )
    holds = "\n".join(f"- *{claim['key']}*: {claim['definition']}." for claim in claims)
    return f"{table}\n\n{extent}\n\nIn a case, a claim holds if\n\n{holds}\n"
