"""The drill ``disks``: full disks, limits on sizes, read-only folders, shared stores, clocks."""

from __future__ import annotations

import resource
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

from tests.drills.command import Ended, ppg
from tests.drills.figures import Figure
from tests.drills.resumable import stored

LAMS = ",".join(f"{k / 100:g}" for k in range(1, 61))
SWEEP = ("sweep", "parallel", "--players", "straight", "--episodes", 50, "--set", f"lam={LAMS}")
STORE = ("--store", "rows.db")
WRITERS: dict[str, tuple[object, ...]] = {
    "sweep": (*SWEEP, *STORE),
    "sweep --export": (*SWEEP, *STORE, "--export", "rows.csv"),
    "solve --out": ("solve", "intersection", "--out", "plan.json"),
    "export": ("export", "../plan.json", "--out", "plan.csv", "--episodes", 2000),
    "render": ("render", "../plan.json", "--out", "plan.png"),
    "show": ("show", "circle(4)", "--out", "game.toml"),
    "library run": ("library", "run", "straight", "door*", "--runs", "runs.jsonl"),
    "train": ("train", "intersection", "--steps", 1024, "--out", "players.npz"),
}


def drill(_size: float) -> Iterator[Figure]:
    """Run commands that write where writing fails."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        made = ppg("solve", "intersection", "--out", "plan.json", folder=root)
        assert made.code == 0, made.err
        ppg(*SWEEP, "--store", "good.db", folder=root)
        good = stored(root / "good.db")
        for kind, words in WRITERS.items():
            with _tmpfs(root, "size=64k") as full:
                (full / "filler").write_bytes(bytes(64 << 10))
                yield _refused(f"full disk: {kind}", ppg(*words, folder=full), full)
        with _tmpfs(root, "size=100k") as full:
            yield _continued(full, lambda: ppg(*SWEEP, *STORE, folder=full), good)
        for kind in ("sweep", "solve --out", "train"):
            with _tmpfs(root, "size=1m") as place:
                small = ppg(*WRITERS[kind], folder=place, prepare=_small_files)
                yield _refused(f"files of at most 2 KiB: {kind}", small, place)
        for kind, words in WRITERS.items():
            with _tmpfs(root, "size=1m") as place:
                subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)
                ended = ppg(*words, folder=place)
                yield _refused(f"read-only folder: {kind}", ended, place)
        yield _together(root, good)
        yield _clock(root, good)


@contextmanager
def _tmpfs(root: Path, size: str) -> Iterator[Path]:
    place = root / "small"
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def _small_files() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (2 << 10, 2 << 10))


def _refused(what: str, ended: Ended, place: Path) -> Figure:
    wrong = ended.refused()
    last = (ended.err.strip().splitlines() or [""])[-1]
    left = [
        path.name for path in place.iterdir() if path.name.startswith((".plan", ".rows", ".game"))
    ]
    failures = [wrong] * bool(wrong) + [f"left {name}" for name in left]
    return Figure(what, "1 command", f"“{last.removeprefix('ppg: '):.110}”", tuple(failures))


def _continued(place: Path, run: Callable[[], Ended], good: bytes) -> Figure:
    first = run()
    subprocess.run(["mount", "-o", "remount,size=8m", str(place)], check=True)
    second = run()
    wrong = first.refused()
    failures = [wrong] if wrong else []
    failures += [f"then exit code {second.code}"] * (second.code != 0)
    failures += ["other rows"] * (second.code == 0 and stored(place / "rows.db") != good)
    return Figure(
        "disk full during a sweep, then enlarged",
        "60 cells",
        "all rows as without",
        tuple(failures),
    )


def _together(root: Path, good: bytes) -> Figure:
    folders = [root / f"writer{k}" for k in range(2)]
    ended: list[Ended] = []
    for folder in folders:
        folder.mkdir()

    def run(folder: Path) -> None:
        ended.append(ppg(*SWEEP, "--store", root / "shared.db", folder=folder))

    threads = [Thread(target=run, args=(folder,)) for folder in folders]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    failures = [f"exit code {one.code}: {one.err[-200:]}" for one in ended if one.code != 0]
    failures += ["other rows"] * (stored(root / "shared.db") != good)
    return Figure(
        "two processes on one store", "60 cells each", "all rows, each once", tuple(failures)
    )


def _clock(root: Path, good: bytes) -> Figure:
    """Let ``time.time`` and the monotonic clocks jump at random, forth and back."""
    folder = root / "clock"
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(
        "import random, time\n"
        "for name in ('time', 'monotonic', 'perf_counter', 'process_time'):\n"
        "    real = getattr(time, name)\n"
        "    jump = lambda real=real: real() + random.choice((0, 0, 0, -86400, 86400, 3e9))\n"
        "    setattr(time, name, jump)\n",
        encoding="utf-8",
    )
    from tests.drills.figures import ROOT

    variables = {"PYTHONPATH": f"{folder}:{ROOT}"}
    ended = ppg(*SWEEP, *STORE, folder=folder, variables=variables)
    failures = [f"exit code {ended.code}: {ended.err[-200:]}"] * (ended.code != 0)
    if not failures:
        failures += ["other rows"] * (stored(folder / "rows.db") != good)
    return Figure(
        "clocks that jump by a day or a century", "60 cells", "all rows as without", tuple(failures)
    )
