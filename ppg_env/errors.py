"""The error raised for invalid input."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """A game, plan or option that cannot be used, described in one sentence.

    Worker processes rebuild an error from its text alone, as in ``type(error)(str(error))``: the
    sentence is then kept as it is.

    Parameters
    ----------
    place
        Where the error is, such as ``"agent[1].noise"`` or ``"head_on.toml"``; without the other
        two, the whole sentence.
    problem
        What is wrong.
    remedy
        What to write instead.
    """

    def __init__(self, place: str, problem: str | None = None, remedy: str | None = None) -> None:
        if problem is None or remedy is None:
            self.place, self.problem, self.remedy = "", place, ""
            super().__init__(place)
            return
        self.place, self.problem, self.remedy = place, problem, remedy
        # Keys and texts of a file may contain line breaks; the sentence must not.
        super().__init__(" ".join(f"{place}: {problem}; {remedy}.".split()))

    def within(self, outer: str, joint: str = ".") -> InputError:
        """Return the error with its place prefixed by ``outer`` (a table, an agent or a file)."""
        if not self.remedy:
            return type(self)(f"{outer}: {self}")
        place = f"{outer}{joint}{self.place}" if self.place else outer
        return type(self)(place, self.problem, self.remedy)

    def __reduce__(self) -> tuple[type[InputError], tuple[str, ...]]:
        parts = (self.place, self.problem, self.remedy)
        return type(self), parts if self.remedy else (str(self),)


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
