"""The drill ``clusters``: sweeps on Dask and Ray from the command line, and shards as on SLURM."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.drills.figures import ROOT, Figure
from tests.drills.resumable import stored
from tests.drills.wheel import wheel_environment

CELLS, TASKS = 24, 3
GRID = """[sweep]
games = ["head_on", "intersection"]
players = ["nash", "straight"]
episodes = 2000
[set]
speed = ["l1"]
lam = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
"""


def drill(_size: float) -> Iterator[Figure]:
    """Compare the rows of every kind of cluster with those of one local process."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        programs = wheel_environment(root, "cluster")
        (root / "plan.toml").write_text(GRID, encoding="utf-8")
        _run([programs / "ppg", "sweep", "plan.toml", "--store", "local.db"], root)
        local = stored(root / "local.db")
        for kind, cluster in (("dask", _dask), ("ray", _ray)):
            with cluster(programs, root) as variables:
                words = [programs / "ppg", "sweep", "plan.toml", "--backend", kind]
                _run([*words, "--store", f"{kind}.db"], root, variables)
            yield _compared(
                f"{kind.capitalize()}, a scheduler and two workers", root / f"{kind}.db", local
            )
        yield _slurm(programs, root, local)


def _slurm(programs: Path, root: Path, local: bytes) -> Figure:
    path = f"{programs}:{os.environ['PATH']}"
    for task in range(1, TASKS + 1):
        variables = {"SLURM_ARRAY_TASK_ID": str(task), "SLURM_ARRAY_TASK_COUNT": str(TASKS)}
        script = ROOT / "examples" / "slurm" / "sweep.sh"
        _run([script, "plan.toml"], root, {"PATH": path, **variables})
    _run([ROOT / "examples" / "slurm" / "merge.sh", "plan.toml"], root, {"PATH": path})
    return _compared(f"scripts for SLURM, {TASKS} tasks, merged", root / "rows.db", local)


def _compared(what: str, store: Path, local: bytes) -> Figure:
    failures = ("rows differ from those of the local run",) if stored(store) != local else ()
    return Figure(what, f"{CELLS} cells", "rows equal the local ones byte for byte", failures)


@contextlib.contextmanager
def _dask(programs: Path, root: Path) -> Iterator[dict[str, str]]:
    address = f"tcp://127.0.0.1:{_free_port()}"
    scheduler = [programs / "dask", "scheduler", "--host", address, "--no-dashboard"]
    worker = [programs / "dask", "worker", address, "--nthreads", "1", "--no-dashboard"]
    with _started(scheduler, root), _started(worker, root), _started(worker, root):
        yield {"DASK_SCHEDULER_ADDRESS": address}


@contextlib.contextmanager
def _ray(programs: Path, root: Path) -> Iterator[dict[str, str]]:
    address = f"127.0.0.1:{_free_port()}"
    start = [programs / "ray", "start", "--block", "--num-cpus", "1", "--disable-usage-stats"]
    head = [*start, "--head", "--port", address.split(":")[1], "--include-dashboard", "false"]
    with _started(head, root):
        _wait_for(address)
        with _started([*start, "--address", address], root):
            time.sleep(10)  # until the second node has joined
            yield {"RAY_ADDRESS": address}


@contextlib.contextmanager
def _started(words: Sequence[object], root: Path) -> Iterator[None]:
    """Run a program in the background, in a group of its own that is ended afterwards."""
    with (root / "cluster.log").open("ab") as log:
        process = subprocess.Popen(
            list(map(str, words)), cwd=root, stdout=log, stderr=log, start_new_session=True,
            env=_clean(root),
        )  # fmt: skip
    try:
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _run(words: Sequence[object], root: Path, variables: dict[str, str] | None = None) -> None:
    done = subprocess.run(
        list(map(str, words)), cwd=root, env=_clean(root) | (variables or {}), check=False,
        capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode != 0:
        log = root / "cluster.log"
        more = log.read_text("utf-8", "replace")[-2000:] if log.exists() else ""
        raise RuntimeError(
            f"{words[:2]} ended with {done.returncode}: {done.stderr[-1500:]}\n{more}"
        )


def _clean(root: Path) -> dict[str, str]:
    """Return the environment without the paths of this checkout, and with an empty home."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    return kept | {"HOME": str(root)}


def _wait_for(address: str) -> None:
    host, port = address.split(":")
    for _ in range(300):
        with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 1):
            return
        time.sleep(0.2)
    raise RuntimeError(f"nothing listens on {address}")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
