"""Coverage-guided fuzzing: inputs that reach new lines of the readers are mutated further.

The seeds are valid files.  A mutation flips, deletes, repeats or splices bytes, or replaces a
number or a word by one that is known to hurt.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from random import Random
from types import CodeType, FrameType
from typing import Any

PACKAGES = ("ppg_env", "solvers", "baselines", "benchmarks")

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
WORD = re.compile(rb"[A-Za-z_]{3,}")
NUMBERS = [
    b"0", b"-1", b"1", b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"-inf", b"NaN", b"Infinity",
    b"1000000", b"1000000000000", b"9" * 400, b"1e999", b"true", b"null", b'"1"', b"[]", b"{}",
]  # fmt: skip
PIECES = [
    b"[" * 60, b"]" * 60, b"{" * 60, b"a." * 60, b"\x00", b"\xff\xfe", b"\x1b]0;x\x07", b"\\ud800",
    b"../../../etc/passwd", b"[/2]", b"=1", b'"', b"\n", b"[[agent]]\n", b"[game]\n", b"__class__",
]  # fmt: skip


def mutated(data: bytes, other: bytes, random: Random) -> bytes:
    """Return ``data`` after one to four changes; ``other`` is another input of the corpus."""
    for _ in range(random.choice((1, 1, 2, 4))):
        at, to = sorted(random.randrange(len(data) + 1) for _ in range(2))
        to = min(to, at + random.choice((1, 4, 16, 256)))
        match random.randrange(8):
            case 0 if data:
                at = min(at, len(data) - 1)
                data = data[:at] + bytes([data[at] ^ 1 << random.randrange(8)]) + data[at + 1 :]
            case 1:
                data = data[:at] + data[to:]
            case 2:
                data = data[:to] + data[at:to] * random.choice((1, 2, 30)) + data[to:]
            case 3:
                data = data[:at] + random.choice(PIECES) + data[at:]
            case 4:
                start = random.randrange(len(other) + 1)
                data = data[:at] + other[start : start + 200] + data[to:]
            case 5 | 6:
                data = _replaced(data, NUMBER, random.choice(NUMBERS), random)
            case _:
                words = WORD.findall(other) or [b"x"]
                data = _replaced(data, WORD, random.choice(words), random)
    return data[:200_000]


def _replaced(data: bytes, what: re.Pattern[bytes], by: bytes, random: Random) -> bytes:
    places = list(what.finditer(data[:50_000]))
    if not places:
        return data
    place = random.choice(places)
    return data[: place.start()] + by + data[place.end() :]


class Lines:
    """The lines of our packages that ran while it was active."""

    def __init__(self) -> None:
        self.seen: set[tuple[CodeType, int]] = set()
        self._ours: dict[str, bool] = {}

    def _trace(self, frame: FrameType, event: str, _: Any) -> Any:
        name = frame.f_code.co_filename
        if name not in self._ours:
            self._ours[name] = any(f"/{package}/" in name for package in PACKAGES)
        if not self._ours[name]:
            return None
        self.seen.add((frame.f_code, frame.f_lineno))
        return self._trace

    def during(self, call: Callable[..., str], *given: Any) -> tuple[str, bool]:
        """Return the result of a call, and whether it is the first to reach some line."""
        before = len(self.seen)
        sys.settrace(self._trace)
        try:
            result = call(*given)
        finally:
            sys.settrace(None)
        return result, len(self.seen) > before
