"""What a plan file claims, against what the evaluator recomputes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.comparison.report import evaluation_report
from ppg_env.formats.plan_file import to_json
from ppg_env.game.evaluation import Evaluation

CLAIM = 1e-6
"""Relative difference of numbers at which a claim is reported."""

MOST_CLAIMS = 4


def different_claims(stored: Mapping[str, Any], evaluation: Evaluation) -> list[dict[str, Any]]:
    """Return the entries of a plan file that differ from the recomputed ones.

    Each is a dictionary with ``entry``, ``claimed`` and ``recomputed``.
    """
    return [
        {"entry": entry, "claimed": stored[entry], "recomputed": value}
        for entry, value in evaluation_report(evaluation).items()
        if entry in stored and value is not None and not _same(stored[entry], value)
    ]


def claims_note(stored: Mapping[str, Any], evaluation: Evaluation) -> str:
    """Return one line on different claims, empty if there are none."""
    found = different_claims(stored, evaluation)
    if not found:
        return ""
    texts = [
        f"{claim['entry']} {_short(claim['claimed'])}, recomputed {_short(claim['recomputed'])}"
        for claim in found[:MOST_CLAIMS]
    ]
    more = f"; {len(found) - MOST_CLAIMS} more" if len(found) > MOST_CLAIMS else ""
    return f"the file claims {'; '.join(texts)}{more}: the recomputed values count"


def _same(claimed: Any, value: Any) -> bool:
    try:
        a, b = np.asarray(claimed, dtype=float), np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):  # texts
        return bool(claimed == json.loads(to_json(value)))
    close = a.shape == b.shape and np.allclose(a, b, rtol=CLAIM, atol=CLAIM, equal_nan=True)
    return bool(close)


def _short(value: Any) -> str:
    text = to_json(value)
    return text if len(text) <= 60 else text[:57] + "..."
