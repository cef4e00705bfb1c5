"""The values that differ between the copies of a simulator, as arrays over copies."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from ppg_env.env.arrays import Tables
from ppg_env.env.reset_options import Given, scaled
from ppg_env.errors import placed
from ppg_env.game.dynamics import square_root
from ppg_env.game.game import Game


class CopyValues:
    """Values of each copy of ``game``, at first those of its ``tables``.

    Attributes
    ----------
    start, goal : (C, N, n) states.
    lam : (C, N) weights of time, the simulator's own array.
    noise : (C, N, n, n) covariances of the noise of a step.
    size : (C, N) factors of the bodies.
    playing : (C, N) whether the agent plays.
    moved : (C,) whether a start or a goal is not the game's.
    """

    def __init__(self, game: Game, tables: Tables, lam: np.ndarray) -> None:
        C, N = lam.shape
        self.game, self.base, self.lam = game, tables, lam
        self._all_roots = np.concatenate([np.tile(tables.root[:N], (C, 1, 1)), tables.root[N:]])
        self.start, self.goal = np.tile(tables.start, (C, 1, 1)), np.tile(tables.goal, (C, 1, 1))
        self._noise = np.zeros(tables.root[:N].shape)
        for own, agent in zip(self._noise, game.agents, strict=True):
            own[: agent.state_dim, : agent.state_dim] = agent.noise
        self.noise, self.size = np.tile(self._noise, (C, 1, 1, 1)), np.ones((C, N))
        self.playing, self.moved = np.ones((C, N), dtype=np.bool_), np.zeros(C, dtype=np.bool_)
        self._lam_before = np.full((C, N), np.nan)
        self._codes = tables.agent_codes.copy()

    @property
    def roots(self) -> np.ndarray:
        """Roots of the agents' noise (C, N, n, n), a view."""
        C, N, n = self.start.shape
        return self._all_roots[: C * N].reshape(C, N, n, n)

    def tables(self, tables: Tables) -> Tables:
        """Return ``tables`` that hold these arrays."""
        n = self.start.shape[2]
        return tables._replace(
            playing=self.playing.reshape(-1),
            start=self.start.reshape(-1, n),
            goal=self.goal.reshape(-1, n),
            root=self._all_roots,
            agent_codes=self._codes,
        )

    def kept(self, rows: np.ndarray) -> list[np.ndarray]:
        """Return all values of the copies ``rows``, for :meth:`put_back`."""
        return [array[rows] for array in self._arrays()]

    def put_back(self, rows: np.ndarray, values: list[np.ndarray]) -> None:
        """Undo all changes of the copies ``rows`` since :meth:`kept`."""
        for array, old in zip(self._arrays(), values, strict=True):
            array[rows] = old

    def restore(self, rows: np.ndarray) -> None:
        """Give copies the game's values; lam is the one from before it was set for an episode."""
        N, before = self.lam.shape[1], self._lam_before[rows]
        self.start[rows], self.goal[rows] = self.base.start, self.base.goal
        self.roots[rows], self.noise[rows] = self.base.root[:N], self._noise
        self.size[rows], self.playing[rows] = 1.0, True
        self.lam[rows] = np.where(np.isnan(before), self.lam[rows], before)
        self._lam_before[rows] = np.nan

    def set_given(self, rows: np.ndarray, given: Given) -> None:
        """Set the values that the client gives."""
        for i, agent in enumerate(given.agents):
            n, goal = agent.state_dim, agent.goal
            self.start[rows, i, :n], self.goal[rows, i, : goal.size] = agent.start, goal
            if given.fields["noise"][i]:
                root = square_root(agent.noise)
                if np.count_nonzero(root - np.diag(np.diag(root))):
                    self._codes[2, i] = 0  # no longer separable: the noise couples axes
                self.roots[rows, i, :n, :n] = root
                self.noise[rows, i, :n, :n] = agent.noise
            if given.fields["lam"][i]:
                self.set_number("lam", rows, i, np.full(len(rows), agent.lam))
        self.size[rows] = given.size
        if given.count is not None:
            self.set_count(rows, np.array([given.count]))

    def set_count(self, rows: np.ndarray, counts: np.ndarray) -> None:
        """Let the first ``counts`` (M,) agents of the copies play."""
        self.playing[rows] = np.arange(self.lam.shape[1]) < counts[:, None]

    def set_number(self, field: str, rows: np.ndarray, i: int, values: np.ndarray) -> None:
        """Set ``lam``, ``noise`` or ``size`` of agent i to ``values`` (M,) for an episode."""
        if field == "lam":
            before = self._lam_before[rows, i]
            self._lam_before[rows, i] = np.where(np.isnan(before), self.lam[rows, i], before)
        if field == "noise":
            n = self.game.agents[i].state_dim
            self.noise[rows, i, :n, :n] = values[:, None, None] * np.eye(n)
            self.roots[rows, i, :n, :n] = np.sqrt(values)[:, None, None] * np.eye(n)
        else:
            getattr(self, field)[rows, i] = values

    def mark_moved(self, rows: np.ndarray) -> None:
        """Update ``moved``."""
        start = (self.start[rows] != self.base.start).any(axis=(1, 2))
        self.moved[rows] = start | (self.goal[rows] != self.base.goal).any(axis=(1, 2))

    def observed(self, field: str, rows: np.ndarray) -> np.ndarray:
        """Return the values (M, N, k) of an observed field (:mod:`ppg_env.env.drawn_entries`)."""
        centre, scale = self.base.centre, self.base.scale
        if field == "goal":
            values = (self.goal[rows][..., : self.game.dim] - centre) / scale
        elif field == "noise":
            d = self.game.dim
            variances = np.trace(self.noise[rows][..., :d, :d], axis1=2, axis2=3) / d
            values = np.sqrt(variances)[..., None] / scale
        else:
            values = getattr(self, field)[rows][..., None]
        return np.asarray(values * self.playing[rows][..., None])

    def game_of(self, c: int) -> Game:
        """Return the game that copy c plays, without missing agents.

        Raises
        ------
        InputError
            If the values are not those of a game.
        """
        agents = []
        for i in np.flatnonzero(self.playing[c]):
            agent, n = self.game.agents[i], self.game.agents[i].state_dim
            with placed(f"agent[{i}]"), warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of growing errors: the game has been reported
                agent = replace(
                    agent,
                    start=self.start[c, i, :n],
                    goal=self.goal[c, i, : agent.goal.size],
                    lam=float(self.lam[c, i]),
                    noise=self.noise[c, i, :n, :n],
                    shape=scaled(agent.shape, float(self.size[c, i])),
                )
            agents.append(agent)
        return replace(self.game, agents=tuple(agents))

    def _arrays(self) -> tuple[np.ndarray, ...]:
        return (
            self.start, self.goal, self.roots, self.noise, self.size, self.playing, self.lam,
            self._lam_before,
        )  # fmt: skip
