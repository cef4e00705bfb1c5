"""The drill ``files``: fuzzing of every reader, with limits and a watch on what is executed."""

from __future__ import annotations

import contextlib
import io
import resource
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random
from time import perf_counter
from typing import Any

from ppg_env.errors import InputError
from tests.drills.figures import Figure, wanted
from tests.drills.guided import Lines
from tests.drills.targets import Target, targets

EXECUTIONS = 40_000
"""Inputs of each kind of file in a night."""

SECONDS, MIB = 10, 1 << 20
MEMORY = 1024 * MIB
"""Limits of one reading: time, and memory in addition to that of the process before it."""

FORBIDDEN = ("os.system", "os.exec", "os.posix_spawn", "os.fork", "subprocess.Popen", "socket.",
             "pickle.find_class", "os.remove", "os.rename", "os.mkdir", "shutil.", "ctypes.dlopen",
             "urllib.Request", "code.__new__")  # fmt: skip


class Watch:
    """An audit hook: what a reader must not do."""

    def __init__(self) -> None:
        self.active, self.events = False, Counter[str]()
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.active:
            return
        writes = (
            event == "open" and isinstance(arguments[1], str) and set(arguments[1]) & set("wax+")
        )
        if event.startswith(FORBIDDEN) or writes:
            self.events[f"{event} {arguments!r:.80}"] += 1


def drill(size: float) -> Iterator[Figure]:
    """Fuzz every kind of file."""
    with tempfile.TemporaryDirectory() as name:
        every = targets(Path(name))
        for target in every.values():
            for seed in target.seeds:  # imports and caches come first, and all seeds are valid
                path = Path(name) / f"seed{target.suffix}"
                path.write_bytes(seed)
                with contextlib.redirect_stdout(io.StringIO()):
                    target.read(path)
        warnings.simplefilter("ignore")
        watch = Watch()
        pages = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (pages + MEMORY, resource.RLIM_INFINITY))
        signal.signal(signal.SIGALRM, _late)
        for kind, target in every.items():
            if not wanted(kind):
                continue
            yield _fuzzed(kind, target, Path(name), round(EXECUTIONS * size), watch)


def _late(*_: object) -> None:
    raise TimeoutError(f"more than {SECONDS} s")


def _fuzzed(kind: str, target: Target, folder: Path, count: int, watch: Watch) -> Figure:
    random, lines = Random(f"{kind} {count}"), Lines()
    corpus, failures, ends = list(target.seeds), dict[str, str](), Counter[str]()
    path, slowest = folder / f"input{target.suffix}", 0.0
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    watch.events.clear()
    for k in range(count):
        parent = random.choice(random.choice((target.seeds, corpus[-200:])))
        data = target.mutate(parent, random.choice(corpus), random)
        path.write_bytes(data)
        started = perf_counter()
        ended, new = lines.during(_outcome, target, path, watch)
        slowest = max(slowest, perf_counter() - started)
        ends[ended.split(":")[0]] += 1
        if ended.startswith("failed"):
            failures.setdefault(ended, f"{ended} ({len(data)} bytes, input {k})")
        elif new:
            corpus.append(data)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    return Figure(
        kind,
        f"{count:,} files",
        f"{ends['accepted']:,} read, {ends['refused']:,} refused; {len(lines.seen):,} lines, "
        f"corpus of {len(corpus)}; slowest {slowest:.2f} s (traced), {grown:.0f} MiB more",
        (*failures.values(), *(f"executed {event}" for event in watch.events)),
    )


def _outcome(target: Target, path: Path, watch: Watch) -> str:
    signal.alarm(SECONDS)
    watch.active = True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            target.read(path)
    except InputError as error:
        text = str(error)
        clear = "\n" not in text and "; " in text and len(text) < 1500
        return "refused" if clear else f"failed: unclear sentence {text!r:.200}"
    except SystemExit as error:  # the checker's refusal, on one line
        return "refused" if "\n" not in str(error.code) else f"failed: {error.code!r:.200}"
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        ours = [
            f for f in traceback.extract_tb(error.__traceback__) if "tests/drills" not in f.filename
        ]
        where = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}" if ours else ""
        return f"failed: {type(error).__name__} {error!s:.80} at {where}"
    finally:
        watch.active = False
        signal.alarm(0)
    return "accepted"
