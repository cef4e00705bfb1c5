"""Ctrl-C: one line on what was kept and how to continue, and exit code 130."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
SHOW_CURSOR = "\x1b[?25h"

_kept = ["nothing was written"]


def keep(what: str) -> None:
    """Set what an interrupt leaves behind, as the end of the sentence ``interrupted: ...``."""
    _kept[-1] = what


@contextmanager
def ended_by_interrupts() -> Iterator[None]:
    """End the process when Ctrl-C comes; files are written atomically, so nothing breaks.

    A thread ends it: code in C, such as a solver's, does not see KeyboardInterrupt.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    # The handler does nothing; that there is one makes Python write to the pipe.
    before = signal.signal(signal.SIGINT, lambda *_: None)
    fd = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    watcher = threading.Thread(target=_watch, args=(reading,), daemon=True)
    watcher.start()
    _kept.append(_kept[0])
    try:
        yield
    finally:
        _kept.pop()
        signal.set_wakeup_fd(fd)
        signal.signal(signal.SIGINT, before)
        os.close(writing)
        watcher.join()


def _watch(reading: int) -> None:
    while number := os.read(reading, 1):
        if number[0] == signal.SIGINT:
            cursor = SHOW_CURSOR if sys.stderr.isatty() else ""
            os.write(2, f"{cursor}\nppg: interrupted: {_kept[-1]}.\n".encode(errors="replace"))
            os._exit(INTERRUPTED)
    os.close(reading)
