"""Compilation by Numba at first use: where machine code is kept, who compiles it, what users see.

Machine code is kept next to the source or, where that is not writable, in the user's cache folder,
as Numba does it.  Where neither is writable (a container without a home), it is kept in a
private temporary folder, which child processes share.  ``NUMBA_CACHE_DIR`` overrides all of them.
Where no folder is writable (a read-only container), each process compiles for itself.

Processes that start at the same time compile once: the first one holds the lock of the function,
the others wait and then load what it has compiled.  Each function has a lock of its own for each
signature, so that two processes compile at the same time what one of them would not wait for.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from typing import Any

import numba
from numba.core.compiler_lock import global_compiler_lock

INTERPRETED = bool(vars(numba.config)["DISABLE_JIT"])
"""Whether kernels run as Python (NUMBA_DISABLE_JIT=1)."""

PATIENCE = 300.0
"""Longest wait in seconds for another process that compiles; then this one compiles as well."""

SILENCE = 1.0
"""Seconds of compilation after which a sentence on stderr says what is happening."""

COMPILING = (
    "compiling the simulator, once per installation, about a minute; 'ppg warm' does it ahead"
)
IN_MEMORY = (
    "compiling the simulator, about a minute in every process, because no folder is writable; "
    "set NUMBA_CACHE_DIR to one that is"
)
WAITING = "waiting for another process that compiles the simulator, about a minute"

config: Any = numba.config  # its settings are made from the environment

_active = threading.local()
_announced = threading.Event()


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile ``function`` at its first call, as ``numba.njit(**options)``, with a shared cache."""
    if function is None:
        return lambda function: njit(function, **options)
    try:
        dispatcher = numba.njit(**options)(function)
    except RuntimeError:  # no folder for the cache is writable
        if not options.get("cache"):
            raise
        dispatcher = _elsewhere(function, options)
    if options.get("cache") and not INTERPRETED:
        dispatcher.compile = _once(dispatcher, dispatcher.compile)
    return dispatcher


def _elsewhere(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Keep machine code in a temporary folder, or in memory only."""
    try:
        keep_code_in(_temporary_folder())
        return numba.njit(**options)(function)
    except (OSError, RuntimeError):
        return numba.njit(**(options | {"cache": False}))(function)


def keep_code_in(folder: str) -> None:
    """Keep machine code in ``folder``, in this process and in those that it starts."""
    os.environ["NUMBA_CACHE_DIR"] = config.CACHE_DIR = folder


@lru_cache(maxsize=1)
def _temporary_folder() -> str:
    """Return a temporary folder that belongs to this user alone; a random one if need be."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = os.path.join(tempfile.gettempdir(), f"ppg_env-{user}")
    with suppress(FileExistsError):
        os.mkdir(folder, 0o700)
    status = os.lstat(folder)
    private = not status.st_mode & 0o022 and (not hasattr(os, "getuid") or status.st_uid == user)
    if os.path.islink(folder) or not private:  # code from others would be run
        folder = tempfile.mkdtemp(prefix="ppg_env-")
    return folder


def _once(dispatcher: Any, compiling: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return ``compiling`` under the lock of its function and signature.

    A function is compiled while the locks of those that call it are held.  Calls have no cycles,
    so no two processes wait for each other; nor do two threads, since one of them compiles.
    The index of a function's code has all its signatures, hence one lock more.
    """
    function = dispatcher.py_func
    name = f"{function.__module__}.{function.__qualname__}"
    save = dispatcher._cache.save_overload

    def place(ending: str) -> str:
        folder = dispatcher.stats.cache_path or os.devnull  # no lock where nothing is kept
        return os.path.join(folder, f"{name}.{ending}")

    def save_alone(signature: Any, result: Any) -> None:
        with locked(place("lock")):
            save(signature, result)

    def compile_or_load(signature: Any) -> Any:
        path = place(f"{hashlib.sha1(str(signature).encode()).hexdigest()[:12]}.lock")
        with global_compiler_lock, _outermost(path, dispatcher) as first:
            if not first:
                return _readable(dispatcher, compiling, signature)
            with locked(path):
                return _readable(dispatcher, compiling, signature)

    dispatcher._cache.save_overload = save_alone
    return compile_or_load


def _readable(dispatcher: Any, compiling: Callable[[Any], Any], signature: Any) -> Any:
    """Return ``compiling(signature)``; kept code of an older release may name what is gone."""
    try:
        return compiling(signature)
    except (AttributeError, ImportError):
        dispatcher._cache.flush()
        return compiling(signature)


@contextmanager
def _outermost(path: str, dispatcher: Any) -> Iterator[bool]:
    """Yield whether this thread does not hold ``path`` yet; say so if it compiles for long."""
    held = _active.__dict__.setdefault("held", [])
    watch = threading.Timer(SILENCE, _announce, (dispatcher,))
    watch.daemon = True
    if not held:
        watch.start()
    held.append(path)
    try:
        yield held.count(path) == 1
    finally:
        held.pop()
        watch.cancel()


def _announce(dispatcher: Any) -> None:
    """Say that ``dispatcher`` is being compiled, unless its machine code is only loaded."""
    if not dispatcher.stats.cache_path:
        _say(IN_MEMORY)
    elif dispatcher.stats.cache_misses:
        _say(COMPILING)


def _say(sentence: str) -> None:
    """Write a sentence on stderr, the first one of this process only."""
    if _announced.is_set():
        return
    _announced.set()
    with suppress(AttributeError, OSError, ValueError):  # stderr may be closed, or missing
        sys.stderr.write(f"ppg_env: {sentence}.\n")
        sys.stderr.flush()


@contextmanager
def locked(path: str, patience: float = PATIENCE) -> Iterator[bool]:
    """Hold the lock file ``path``; yield False where there are no locks, or after ``patience``.

    The system releases the lock of a process that dies.
    """
    try:
        import fcntl

        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except (ImportError, OSError):
        yield False
        return
    try:
        yield _acquire(lambda: fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB), patience)
    finally:
        os.close(file)


def _acquire(attempt: Callable[[], None], patience: float) -> bool:
    start = time.monotonic()
    while True:
        try:
            attempt()
            return True
        except BlockingIOError:
            waited = time.monotonic() - start
            if waited >= patience:
                return False
            if waited >= SILENCE:
                _say(WAITING)
            time.sleep(0.05)
        except OSError:  # a file system without locks
            return False
