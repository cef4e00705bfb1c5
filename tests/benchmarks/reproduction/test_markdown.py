"""Verdicts of two rules of collisions, next to each other."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.reproduction.claims import CLAIMS
from benchmarks.reproduction.markdown import claims_markdown, compared_markdown
from ppg_env import InputError

DOCS = Path(__file__).parents[3] / "docs"


def stored(path: Path, outcomes: str, **changes: Any) -> Path:
    """Results of one claim, with a case for each letter: + holds, - fails."""
    cases = [
        {"scenario": f"s{k}", "holds": sign == "+", "evidence": f"{path.stem} {k}"}
        for k, sign in enumerate(outcomes)
    ]
    holding = outcomes.count("+")
    word = {0: "fails", len(cases): "holds"}.get(holding, "depends")
    claim = {"key": "claim|a", "word": word, "holding": holding, "total": len(cases)}
    content = {"episodes": 10, "seed": 0, "lam": [0.5], "panels": [1, 2], "collisions": path.stem}
    content["claims"] = [claim | {"cases": cases}]
    path.write_text(json.dumps(content | changes))
    return path


def test_cases_are_compared_one_by_one(tmp_path: Path) -> None:
    text = compared_markdown(
        stored(tmp_path / "instants.json", "++--"), stored(tmp_path / "swept.json", "-+++")
    )
    head, _, line, *rest = text.splitlines()
    assert head == "| claim | instants | swept | newly holds | no longer holds |"
    assert line == "| **claim\\|a** | depends, 2/4 | depends, 3/4 | 2 | 1 |"
    assert "Claims with another verdict: none." in rest
    extent = "2 figure rows, 1 values of lam, 10 episodes of each plan, seed 0."
    assert (
        f"{extent} A crash is an overlap at the time steps (instants), during the steps (swept)."
        in rest
    )


def test_verdicts_that_differ_are_named(tmp_path: Path) -> None:
    text = compared_markdown(
        stored(tmp_path / "instants.json", "++"), stored(tmp_path / "swept.json", "+-")
    )
    assert "another verdict: claim|a (holds, depends)." in text


def test_runs_of_different_extents_are_not_compared(tmp_path: Path) -> None:
    first = stored(tmp_path / "instants.json", "+")
    with pytest.raises(InputError, match="another extent"):
        compared_markdown(first, stored(tmp_path / "swept.json", "+", episodes=20))


def test_the_docs_compare_all_claims() -> None:
    first, second = (DOCS / f"reproduction-{rule}.json" for rule in ("instants", "swept"))
    assert json.loads(first.read_text())["collisions"] == "instants"
    assert json.loads(second.read_text())["collisions"] == "swept"
    for path in (first, second):
        assert json.loads(path.read_text())["failed"] == []
        assert claims_markdown(path)
    text = compared_markdown(first, second)
    assert all(f"**{claim.key}**" in text for claim in CLAIMS)
