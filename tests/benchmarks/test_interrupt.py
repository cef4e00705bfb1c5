"""Ctrl-C: one line, exit code 130, and no process left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")

PATIENCE = 120.0


def started(*words: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "benchmarks", *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(condition) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.05)


def test_an_interrupt_says_what_is_kept(tmp_path):
    store = tmp_path / "rows.db"
    words = ("head_on", "--set", "lam=0.2,0.5", "--episodes", 10**9, "--store", store)
    run = started("sweep", *words)
    wait_for(store.exists)
    run.send_signal(signal.SIGINT)
    _, err = run.communicate(timeout=PATIENCE)
    assert run.returncode == 130
    last = f"ppg: interrupted: rows in {store} are kept, and the same command continues from them."
    assert err.splitlines()[-1] == last
    assert "Traceback" not in err


@pytest.mark.slow
def test_an_interrupt_of_a_planner_inside_its_back_end(tmp_path):
    run = started("solve", "circle(8)", "--solution", "social", "--solver", "HIGHS")
    wait_for(lambda: cpu_seconds(run.pid) > 5)
    run.send_signal(signal.SIGINT)
    _, err = run.communicate(timeout=PATIENCE)
    assert run.returncode == 130
    assert err.splitlines()[-1] == "ppg: interrupted: nothing was written."


@pytest.mark.slow
@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGKILL])
def test_trainings_end_with_the_command(tmp_path, sign):
    out = tmp_path / "players.npz"
    words = ("head_on", "--seeds", 2, "--jobs", 2, "--steps", 50_000_000, "--out", out)
    run = started("train", *words)
    folder = tmp_path / "players.npz.checkpoints"
    wait_for(lambda: len(list(folder.glob("seed-*.pt"))) == 2)
    workers = children(run.pid)
    assert len(workers) >= 2
    second = started("train", *words)
    _, err = second.communicate(timeout=PATIENCE)
    assert second.returncode == 2
    assert "is held by another process; wait for the other training" in err
    run.send_signal(sign)
    run.communicate(timeout=PATIENCE)
    assert run.returncode == (130 if sign == signal.SIGINT else -sign)
    wait_for(lambda: not any(alive(worker) for worker in workers))


def cpu_seconds(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def children(process: int) -> list[int]:
    return [int(k) for k in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
