"""Observation of what an episode has drawn: entries after the usual ones, constant in an episode.

Every field that ``randomize`` draws adds its entries, in this order; without a rule there are none:

=========  ==================================================================
field      value of an agent
=========  ==================================================================
lam        its weight of time
noise      its standard deviation per step and axis, divided by ``scale``
size       the factor of its body
goal       its goal's position relative to the centre, divided by ``scale``
=========  ==================================================================

Each field has the agent's own value first, then those of the other agents in the order of the
game, zeros for missing ones.  A ``shared`` field has one entry.  Starts are observed as states, and
who plays by the entry ``present`` of each agent.

The observations ``neighbours`` and ``lidar`` hold own values only.  The global state has those of
all agents, in the order of the game, at its end.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ppg_env.env.draws import own_number
from ppg_env.env.observation import observation_frame
from ppg_env.env.randomize import Randomize
from ppg_env.errors import require
from ppg_env.game.game import Game

OBSERVED = ("lam", "noise", "size", "goal")


class Values(Protocol):
    """Values of copies, such as :class:`~ppg_env.env.copy_values.CopyValues`."""

    def observed(self, field: str, rows: np.ndarray) -> np.ndarray:
        """Return the values (M, N, k) of an observed field in the copies ``rows``."""


class OwnValues:
    """The values of ``game`` itself, of a single copy."""

    def __init__(self, game: Game) -> None:
        self.game = game

    def observed(self, field: str, rows: np.ndarray) -> np.ndarray:
        """Return the values (1, N, k) of an observed field."""
        game, (centre, scale) = self.game, observation_frame(self.game)
        if field == "goal":
            return np.array([[(a.goal[: game.dim] - centre) / scale for a in game.agents]])
        values = np.array([[own_number(field, game, i) for i in range(len(game.agents))]])
        return np.sqrt(values) / scale if field == "noise" else values


def observed_fields(rule: Randomize | None) -> tuple[str, ...]:
    """Return the fields that a rule draws and observations hold, in their order."""
    return tuple(f for f in OBSERVED if rule is not None and getattr(rule, f) is not None)


class DrawnEntries:
    """The entries that a rule adds to the observations of a game's agents.

    Raises :class:`InputError` if ``rule`` is no rule.

    Attributes
    ----------
    size : number of entries of an agent.
    own : (size,) whether the entry is about the agent itself.
    state_size : number of entries of the global state.
    """

    def __init__(self, rule: Randomize | None, game: Game) -> None:
        N, fits = len(game.agents), rule is None or isinstance(rule, Randomize)
        require(fits, "randomize", f"is {rule!r:.40}", "give a Randomize")
        shared = () if rule is None else rule.shared
        drawn = observed_fields(rule)
        self.fields = [(f, game.dim if f == "goal" else 1, f in shared) for f in drawn]
        flags = [np.arange(k if alone else N * k) < k for _, k, alone in self.fields]
        self.own = np.concatenate([np.zeros(0, dtype=bool), *flags])
        self.size = self.own.size
        self.state_size = sum(N * k for _, k, _ in self.fields)
        index = np.arange(N)
        self._order = np.array([[i, *np.delete(index, i)] for i in index])

    def require_same(self, others: DrawnEntries) -> None:
        """Raise :class:`InputError` unless the ``others`` are the same fields."""
        require(
            others.fields == self.fields,
            "randomize",
            f"draws {_listed(others.fields)} where observations hold {_listed(self.fields)}",
            "draw the same fields, or make a new environment",
        )

    def read(self, values: Values, rows: np.ndarray) -> np.ndarray:
        """Return the entries (M, N, size) of the copies ``rows``."""
        M, N = len(rows), len(self._order)
        parts = [np.zeros((M, N, 0))]
        for field, _, alone in self.fields:
            own = values.observed(field, rows)
            parts.append(own if alone else own[:, self._order].reshape(M, N, -1))
        return np.concatenate(parts, axis=2)

    def state(self, values: Values, rows: np.ndarray) -> np.ndarray:
        """Return the entries (M, state_size) of the global state."""
        parts = [values.observed(f, rows).reshape(len(rows), -1) for f, _, _ in self.fields]
        return np.concatenate([np.zeros((len(rows), 0)), *parts], axis=1)

    def limits(self, length: float) -> list[tuple[float, float]]:
        """Return the lowest and highest value of each entry; ``length`` bounds all but lam."""
        N, result = len(self._order), []
        for field, k, alone in self.fields:
            high = 1.0 if field == "lam" else length
            result += [(-length if field == "goal" else 0.0, high)] * (k if alone else N * k)
        return result


def _listed(fields: list[tuple[str, int, bool]]) -> str:
    names = [f"a shared {field}" if shared else field for field, _, shared in fields]
    return " and ".join(names) or "no draws"
