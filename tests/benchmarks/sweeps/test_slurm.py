"""The scripts for SLURM, with its variables: the merged rows are those of one sweep."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.sweeps import Cell, Store, sweep
from tests.benchmarks.sweeps.conftest import timeless

ROOT = Path(__file__).parents[3]
LAMS = (0.1, 0.3, 0.5)
GRID = f"""[sweep]
games = ["parallel"]
players = ["straight"]
episodes = 50
[set]
lam = {list(LAMS)}
"""


@pytest.mark.slow
def test_tasks_and_merge_give_the_rows_of_one_sweep(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text(GRID, encoding="utf-8")
    command = tmp_path / "bin" / "ppg"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m benchmarks "$@"\n', encoding="utf-8")
    command.chmod(0o755)
    variables = {"PATH": f"{command.parent}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    for task in ("1", "2"):
        slurm = {"SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_COUNT": "2"}
        run("sweep.sh", tmp_path, variables | slurm)
    run("merge.sh", tmp_path, variables)
    cells = [Cell("parallel", "straight", {"lam": lam}, episodes=50) for lam in LAMS]
    with Store(tmp_path / "rows.db") as store:
        assert timeless(store.rows()) == timeless(sweep(cells, tmp_path / "local.db"))


def run(script: str, folder: Path, variables: dict[str, str]) -> None:
    words = [str(ROOT / "examples" / "slurm" / script), "plan.toml"]
    subprocess.run(words, cwd=folder, env=os.environ | variables, check=True, capture_output=True)
