"""Learners of a track, which observe what episodes draw: files of players, and Python files.

A Python file is a learner of any kind.  It has a function ``team(game, run)`` that returns one
callable per agent of ``game``, the track's game with all its agents.  Each takes observations
(C, W), float32, of C episodes, and returns actions (C, m) in the units of the game.  ``RUNS``, by
default 1, is the number of its trainings.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.library.learned.track import Track
from ppg_env.env.players import Player, View
from ppg_env.errors import InputError, require
from ppg_env.game.game import Game

Act = Callable[[np.ndarray], np.ndarray]


class ObservingPlayer:
    """Plays one agent by a function of its observations."""

    information = "full state"

    def __init__(self, function: Act) -> None:
        self.function = function

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m)."""
        try:
            return np.asarray(self.function(view.observation), dtype=float)
        except Exception as error:  # of code that is not ours
            raise _failure("the player", error) from None


def learner(track: Track, name: str) -> list[Sequence[Player]] | None:
    """Return the players of each training in the track's game; None if ``name`` is no learner.

    Raises
    ------
    InputError
        If the file is missing or does not hold what the module describes.
    """
    from baselines.policy_file import read_learned
    from baselines.pretrained import PLAYERS as PRETRAINED
    from baselines.pretrained import find_pretrained

    if name.endswith(".py"):
        return _python_teams(Path(name), track.game)
    if name in PRETRAINED:
        learned = find_pretrained(name, track.game)
    elif name.endswith(".npz"):
        learned = read_learned(name)
    else:
        return None
    return [learned.players(track.game, run) for run in range(len(learned.runs))]


def _python_teams(path: Path, game: Game) -> list[Sequence[Player]]:
    require(path.is_file(), str(path), "is not a file", "name a Python file with team(game, run)")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        runs = [module.team(game, run) for run in range(getattr(module, "RUNS", 1))]
    except Exception as error:  # of code that is not ours
        raise _failure(str(path), error) from None
    for team in runs:
        fits = isinstance(team, Sequence) and len(team) == len(game.agents)
        require(
            fits and all(map(callable, team)),
            f"{path}, team",
            "does not return one callable per agent",
            f"return a list of {len(game.agents)}",
        )
    return [[ObservingPlayer(function) for function in team] for team in runs]


def _failure(place: str, error: Exception) -> InputError:
    reason = f"{type(error).__name__}: {error}".partition("\n")[0][:200]
    return InputError(place, f"fails ({reason})", "run its code on its own first")
