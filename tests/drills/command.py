"""The command ``ppg`` in a process of its own, within limits."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from tests.drills.figures import ROOT

GIB = 1 << 30


@dataclass(frozen=True)
class Ended:
    """How a command ended: exit code (None at the time limit), output, CPU seconds, peak MiB."""

    code: int | None
    out: str
    err: str
    seconds: float
    mebibytes: float

    def refused(self) -> str:
        """Return what is wrong with the refusal of bad input; nothing if it is one clear line."""
        last = self.err.strip().splitlines()[-1:] or [""]
        if self.code != 2:
            return f"exit code {self.code}: {last[0]:.200}"
        if "Traceback" in self.err:
            return f"a traceback: {last[0]:.200}"
        typer = last[0].startswith("╰")  # an option of the wrong type
        return "" if typer or last[0].startswith("ppg: ") else f"no sentence: {last[0]:.200}"


def ppg(
    *words: object,
    folder: Path,
    seconds: float = 60.0,
    memory: float = 6.0,
    prepare: Callable[[], None] | None = None,
    variables: Mapping[str, str] | None = None,
) -> Ended:
    """Run ``ppg`` in ``folder``, with limits of wall time and of address space in GiB."""

    def limits() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (int(memory * GIB), int(memory * GIB)))
        if prepare is not None:
            prepare()

    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "benchmarks", *map(str, words)]
    # Elsewhere: the folder's disk may be full.
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
            env=environment | dict(variables or {}), preexec_fn=limits,
        )  # fmt: skip
        code, used = _awaited(process, seconds)
        texts = [_read(stream) for stream in (out, err)]
    process.returncode = 0 if code is None else code
    return Ended(code, texts[0], texts[1], used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def _awaited(process: subprocess.Popen[bytes], seconds: float) -> tuple[int | None, Any]:
    """Return exit code and use of resources; None if it had to be killed at the limit."""
    end = time.monotonic() + seconds
    while True:
        done, status, used = os.wait4(process.pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status), used
        if time.monotonic() > end:
            process.kill()
            return None, os.wait4(process.pid, 0)[2]
        time.sleep(0.02)


def _read(stream: IO[bytes]) -> str:
    stream.seek(0)
    return stream.read().decode("utf-8", "replace")
