"""What differs between the copies of a simulator: values given at a reset, or drawn by a rule.

Every episode starts from the game's values; those of the rule are drawn, others are given.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ppg_env.env.arrays import Tables
from ppg_env.env.arrival_regions import check_starts
from ppg_env.env.copy_values import CopyValues
from ppg_env.env.draw_streams import DrawStreams
from ppg_env.env.draws import Draws
from ppg_env.env.own_bodies import OwnBodies
from ppg_env.env.placement import Placement
from ppg_env.env.randomize import Randomize
from ppg_env.env.reset_options import Given
from ppg_env.env.rule_checks import check_rule, refuse_with_margins
from ppg_env.errors import InputError, placed
from ppg_env.game.game import Game


class Variation:
    """The varying ``values`` of the copies of ``game``, and the draws of ``seed``.

    ``lam`` (C, N) is the simulator's own array.
    """

    def __init__(
        self, game: Game, tables: Tables, lam: np.ndarray, seed: np.random.SeedSequence
    ) -> None:
        self.values = CopyValues(game, tables, lam)
        self._game, self._base = game, tables
        self._draws: Draws | None = None
        self._bodies: OwnBodies | None = None
        self._episodes = np.zeros(len(lam), dtype=np.int64)
        self.seed(seed)

    def seed(self, seed: np.random.SeedSequence) -> None:
        """Restart the draws of all copies."""
        self._streams = DrawStreams(seed)
        self._episodes[:] = 0

    def adopt(self, rule: Randomize | None) -> None:
        """Draw by ``rule`` from the next episodes on.

        Raises
        ------
        InputError
            If it does not fit the game or the rules of play.
        """
        if rule is not None:
            check_rule(rule, self._game, self._base)
        game, base = self._game, self._base
        self._draws = None if rule is None else Draws(rule, game, base, self._placement)

    def begin(self, tables: Tables, chosen: np.ndarray, given: Given | None) -> Tables:
        """Set the values of the next episodes of the ``chosen`` (C,) copies; return the tables.

        Raises
        ------
        InputError
            If the values are not those of a game, or no valid ones are drawn.  Then no copy
            changes.
        """
        rows, values = np.flatnonzero(chosen), self.values
        if not rows.size:
            return tables
        before = values.kept(rows)
        try:
            values.restore(rows)
            if given is not None:
                refuse_with_margins(given.given, self._base, "options")
                values.set_given(rows, given)
            if self._draws is not None:
                self._draws.draw(values, rows, self._episodes, self._streams, given)
            if given is not None:
                self._check_given(int(rows[0]))
        except InputError:
            values.put_back(rows, before)
            raise
        self._episodes[rows] += 1
        values.mark_moved(rows)
        # Tables hold the arrays of the values: linked again, since a copied simulator has its own.
        return self._with_bodies(values.tables(tables), rows)

    @cached_property
    def _placement(self) -> Placement:
        return Placement(self._game, self._base)

    def _check_given(self, c: int) -> None:
        """Refuse values of copy c that are not those of a game."""
        with placed("options"):
            agents = self.values.game_of(c).agents
            if not self._base.scheduled:
                halves = zip(agents, self._base.tolerance, strict=False)
                check_starts(agents, [half[: agent.goal.size] for agent, half in halves])

    def _with_bodies(self, tables: Tables, rows: np.ndarray) -> Tables:
        """Return tables with the bodies of each copy, once any of them has another size."""
        size = self.values.size
        if self._bodies is None:
            if not (size[rows] != 1).any():
                return tables
            self._bodies, rows = OwnBodies(self._game, len(size)), np.arange(len(size))
        self._bodies.resize(size, rows)
        return self._bodies.tables(tables)
