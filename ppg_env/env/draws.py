"""Drawing the values of episodes by a rule, until they are those of a valid game."""

from __future__ import annotations

import numpy as np

from ppg_env.env.arrays import Tables
from ppg_env.env.copy_values import CopyValues
from ppg_env.env.draw_streams import DrawStreams
from ppg_env.env.placement import ROUNDS, Placement, Places
from ppg_env.env.randomize import FIELDS, Distribution, Randomize
from ppg_env.env.reset_options import Given
from ppg_env.errors import InputError
from ppg_env.game.game import Game

COUNT = len(FIELDS)
"""The stream of numbers of agents; those of fields are their places in ``FIELDS``."""

Free = dict[str, dict[int, Distribution]]
"""For each field, the agents whose value is drawn, and from what."""


class Draws:
    """Draws values of episodes of ``game``, whose tables are ``tables``, by ``rule``."""

    def __init__(self, rule: Randomize, game: Game, tables: Tables, placement: Placement) -> None:
        self._rule, self._game, self._base, self._placement = rule, game, tables, placement
        self._drawn: Free = {
            field: {i: one for i, one in enumerate(rule.each(field, game.agent_names)) if one}
            for field in FIELDS
        }

    def draw(
        self,
        values: CopyValues,
        rows: np.ndarray,
        episodes: np.ndarray,
        streams: DrawStreams,
        given: Given | None,
    ) -> None:
        """Write to ``values`` what the copies ``rows`` draw in the ``episodes`` (C,) they begin.

        What the client has given is not drawn.

        Raises
        ------
        InputError
            If no valid values are found in ``ROUNDS`` tries.
        """
        free = self._drawn
        if given is not None:
            free = {
                field: {i: one for i, one in each.items() if not given.fields[field][i]}
                for field, each in free.items()
            }
        source = _Source(streams, episodes, 0)
        if self._rule.agents is not None and (given is None or given.count is None):
            self._draw_counts(values, rows, source)
        for field in ("lam", "noise"):  # like the numbers of agents, drawn once: places give way
            self._draw_numbers(field, values, rows, source, free)
        for attempt in range(ROUNDS):
            source = _Source(streams, episodes, attempt)
            self._draw_numbers("size", values, rows, source, free)
            if not (free["start"] or free["goal"] or free["size"]):
                return
            fits = self._draw_places(values, rows, source, free)
            if free["size"] or given is not None:  # else those that are not drawn fit
                fits &= self._placement.valid(_places(values, rows))
            rows = rows[~fits]
            if not rows.size:
                return
        raise _hopeless(values, int(rows[0]))

    def _draw_counts(self, values: CopyValues, rows: np.ndarray, source: _Source) -> None:
        counts = np.array(self._rule.counts(len(self._game.agents)))
        share = source.uniform(rows, COUNT)[:, 0]
        values.set_count(rows, counts[(share * len(counts)).astype(np.int64)])

    def _draw_numbers(
        self, field: str, values: CopyValues, rows: np.ndarray, source: _Source, free: Free
    ) -> None:
        """Draw lam, noise or size."""
        for i, distribution in free[field].items():
            stream = 0 if field in self._rule.shared else i
            share = source.uniform(rows, FIELDS.index(field), stream)
            own = own_number(field, self._game, i)
            values.set_number(field, rows, i, distribution.draw(share, own)[:, 0])

    def _draw_places(
        self, values: CopyValues, rows: np.ndarray, source: _Source, free: Free
    ) -> np.ndarray:
        """Draw starts and goals, and return (M,) whether all that are drawn fit."""
        check, places = self._placement, _places(values, rows)

        def start_fits(i: int, some: Places, placed: np.ndarray) -> np.ndarray:
            fits = check.starts_fit(i, some, placed)
            return fits if i in free["goal"] else fits & ~check.arrived(i, some)

        def goal_fits(i: int, some: Places, placed: np.ndarray) -> np.ndarray:
            return check.goals_fit(i, some, placed) & ~check.arrived(i, some)

        def start(i: int, tries: int, some: np.ndarray) -> np.ndarray:
            return self._points("start", i, rows[some], source, tries)

        def goal(i: int, tries: int, some: np.ndarray) -> np.ndarray:
            return self._points("goal", i, rows[some], source, tries)

        fits = check.draw(list(free["start"]), places.start, start_fits, places, start)
        fits &= check.draw(list(free["goal"]), places.goal, goal_fits, places, goal)
        values.start[rows], values.goal[rows] = places.start, places.goal
        return fits

    def _points(
        self, field: str, i: int, rows: np.ndarray, source: _Source, tries: int
    ) -> np.ndarray:
        """Draw states (M, n) of agent i."""
        distribution, own = self._drawn[field][i], getattr(self._base, field)[i]
        k = distribution.components or self._game.dim
        share = source.uniform(rows, FIELDS.index(field), i, tries, size=k)
        states = np.tile(own, (len(rows), 1))
        states[:, :k] = distribution.draw(share, own[:k])
        return states


class _Source:
    """The uniform numbers of one attempt."""

    def __init__(self, streams: DrawStreams, episodes: np.ndarray, attempt: int) -> None:
        self._streams, self._episodes, self._attempt = streams, episodes, attempt

    def uniform(self, rows: np.ndarray, *words: int, size: int = 1) -> np.ndarray:
        """Return numbers (M, size) of the copies ``rows``."""
        return self._streams.uniform(rows, self._episodes[rows], self._attempt, *words, size=size)


def _places(values: CopyValues, rows: np.ndarray) -> Places:
    return Places(values.start[rows], values.goal[rows], values.size[rows], values.playing[rows])


def own_number(field: str, game: Game, i: int) -> np.ndarray:
    """Return (1,) the game's ``lam``, ``noise`` or ``size`` of agent i."""
    agent, d = game.agents[i], game.dim
    noise = float(np.trace(agent.noise[:d, :d]) / d)
    return np.array([{"lam": agent.lam, "noise": noise, "size": 1.0}[field]])


def _hopeless(values: CopyValues, c: int) -> InputError:
    """Return the error that says why the last draw of copy c is not valid."""
    problem = f"found no valid episode in {ROUNDS} tries"
    try:
        values.game_of(c)
    except InputError as error:
        problem += f"; in the last one {error.place} {error.problem}"
    remedy = "widen its distributions, or make bodies smaller or fewer"
    return InputError("randomize", problem, remedy)
