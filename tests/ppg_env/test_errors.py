"""Errors survive what worker processes do to them: pickles, and new errors of their text alone."""

from __future__ import annotations

import copy
import inspect
import pickle
from typing import Any

import pytest

from ppg_env import errors, make_game
from ppg_env.errors import InputError, placed

CLASSES = [
    kind
    for _, kind in inspect.getmembers(errors, inspect.isclass)
    if issubclass(kind, Exception) and kind.__module__ == errors.__name__
]


def raised() -> InputError:
    with pytest.raises(InputError) as caught, placed("game.toml", ": "):
        make_game("head_on", lam=2.0)
    return caught.value


@pytest.mark.parametrize("kind", CLASSES)
def test_an_error_is_made_of_one_sentence(kind: Any) -> None:
    error = kind("agent[0].lam: is 2; write a number with 0 <= lam < 1.")
    assert str(error) == error.args[0] == "agent[0].lam: is 2; write a number with 0 <= lam < 1."
    assert isinstance(error, ValueError)


@pytest.mark.parametrize("rebuild", [
    lambda error: type(error)(str(error)),  # as Gymnasium's and AgileRL's workers
    lambda error: type(error)(*error.args),
    lambda error: pickle.loads(pickle.dumps(error)),
    lambda error: pickle.loads(pickle.dumps(type(error)(str(error)))),
    copy.deepcopy,
])  # fmt: skip
def test_an_error_keeps_its_sentence(rebuild: Any) -> None:
    error = raised()
    again = rebuild(error)
    assert type(again) is InputError
    assert (
        str(again)
        == str(error)
        == "game.toml: agent[0].lam: is 2; write a number with 0 <= lam < 1."
    )
    with pytest.raises(InputError, match=r"^game\.toml: agent\[0\]\.lam: is 2; write"):
        raise again


def test_a_pickle_keeps_the_parts_and_a_sentence_takes_a_place() -> None:
    error = pickle.loads(pickle.dumps(raised()))
    assert (error.place, error.problem) == ("game.toml: agent[0].lam", "is 2")
    assert str(InputError("too wide.").within("agent[1]")) == "agent[1]: too wide."
