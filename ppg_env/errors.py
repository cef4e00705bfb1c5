"""The error raised for invalid input."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """A game, plan or option that cannot be used, described in one sentence.

    Parameters
    ----------
    place
        Where the error is, such as ``"agent[1].noise"`` or ``"head_on.toml"``.
    problem
        What is wrong.
    remedy
        What to write instead.
    """

    def __init__(self, place: str, problem: str, remedy: str) -> None:
        self.place, self.problem, self.remedy = place, problem, remedy
        # Keys and texts of a file may contain line breaks; the sentence must not.
        super().__init__(" ".join(f"{place}: {problem}; {remedy}.".split()))

    def within(self, outer: str, joint: str = ".") -> InputError:
        """Return the error with its place prefixed by ``outer`` (a table, an agent or a file)."""
        place = f"{outer}{joint}{self.place}" if self.place else outer
        return type(self)(place, self.problem, self.remedy)

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str]]:
        return type(self), (self.place, self.problem, self.remedy)


def require(condition: bool, place: str, problem: str, remedy: str) -> None:
    """Raise :class:`InputError` unless ``condition`` holds."""
    if not condition:
        raise InputError(place, problem, remedy)


@contextmanager
def placed(place: str, joint: str = ".") -> Iterator[None]:
    """Prefix the place of any :class:`InputError` raised in the block with ``place``."""
    try:
        yield
    except InputError as error:
        raise error.within(place, joint) from None
