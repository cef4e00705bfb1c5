"""Processes: one at a time on a file, and workers that end with their parent."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from ppg_env.errors import InputError

CHECK = 1.0
"""Seconds between two looks at whether the parent lives."""


@contextmanager
def alone_on(path: str | Path, remedy: str) -> Iterator[None]:
    """Hold the lock file ``path``, which is removed afterwards.

    The system releases the lock of a process that dies.  File systems without locks have none.

    Raises
    ------
    InputError
        If another process holds it; ``remedy`` says what to do.
    """
    try:
        import fcntl

        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except (ImportError, OSError):
        yield
        return
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(str(path), "is held by another process", remedy) from None
        except OSError:
            pass
        yield
        Path(path).unlink(missing_ok=True)
    finally:
        os.close(file)


def size_limited() -> bool:
    """Return whether the system limits the sizes of files that this process writes."""
    try:
        import resource
    except ImportError:  # Windows
        return False
    return resource.getrlimit(resource.RLIMIT_FSIZE)[0] != resource.RLIM_INFINITY


@cache
def exit_with_parent(parent: int) -> None:
    """End this process when ``parent`` has ended, also if it was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(CHECK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
