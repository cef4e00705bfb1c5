"""The command ``ppg``, run in the process of the tests."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from benchmarks.cli import main


@dataclass(frozen=True)
class Run:
    """What a command left behind: exit code, stdout, stderr."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Stdout as one strict JSON object."""
        report = json.loads(self.out, parse_constant=_refuse)
        assert isinstance(report, dict)
        return report


Ppg = Callable[..., Run]
"""Takes the words after ``ppg``, and the exit code to expect as ``code``, 0 by default."""


def run_ppg(capsys: pytest.CaptureFixture[str], *words: object, code: int = 0) -> Run:
    """Run ``ppg`` with these words, and expect this exit code."""
    capsys.readouterr()
    left = 0
    try:
        main([str(word) for word in words])
    except SystemExit as leave:
        left = int(leave.code or 0)
    run = Run(left, *capsys.readouterr())
    assert run.code == code, run.err
    return run


def _refuse(word: str) -> None:
    raise AssertionError(f"{word} is not JSON")
