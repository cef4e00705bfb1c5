"""A plan file that several commands read."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.cli import main


@pytest.fixture(scope="session")
def plan_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The social optimum of a crossing under heavy noise, as ``ppg solve --out`` writes it."""
    path = tmp_path_factory.mktemp("plans") / "plan.json"
    words = ["solve", "intersection", "--solution", "social", "--noise", "40", "--out", str(path)]
    with pytest.raises(SystemExit) as leave:
        main(words)
    assert not leave.value.code
    return path
