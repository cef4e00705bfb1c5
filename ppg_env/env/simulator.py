"""The batched simulator: it steps many copies of one game at once and restarts those that end.

    simulator = Simulator(make_game("head_on"), copies=4096, seed=0)
    observation = simulator.reset()
    step = simulator.step(actions)          # actions (copies, N, m)

All arrays are (copies, agents, ...).  The next step overwrites them; copy what you keep.
"""

from __future__ import annotations

from dataclasses import replace
from operator import is_
from typing import Any

import numpy as np

from ppg_env.env.actions import action_boxes, batch_of_actions, without_unusable
from ppg_env.env.argument_checks import check_simulation
from ppg_env.env.arrays import Tables, make_tables
from ppg_env.env.compiled import compiled_kernel
from ppg_env.env.drawn_entries import DrawnEntries
from ppg_env.env.normals import Normals
from ppg_env.env.observation import observation_size
from ppg_env.env.players import View
from ppg_env.env.randomize import Randomize
from ppg_env.env.reset_options import read_options
from ppg_env.env.rules import Rules
from ppg_env.env.seeds import seed_sequence
from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.env.step import Step, make_step
from ppg_env.env.variation import Variation
from ppg_env.errors import InputError, require
from ppg_env.game.game import Game


class Simulator:
    """``copies`` of ``game`` under ``rules``; a seed fixes all noise and all draws.

    Changing ``max_cycles`` changes ``rules`` as well.  ``randomize`` says what every episode draws
    (:mod:`ppg_env.env.randomize`); a rule of the same layout may replace it at any time.

    Attributes
    ----------
    bodies : (C, N + K, n) states of the agents, then of the K moving obstacles, in the order of
        the game; positions are the first d components.
    status : (C, N) codes of :mod:`ppg_env.env.status`.
    parked : (C, N) times of arrival; huge before it.
    entries : the entries of observations about what is drawn.
    variation : what differs between copies; None as long as nothing does.
    alive : (C, N) whether the agent still acts.
    clock : (C,) time of each copy.
    lam : (C, N) weights of time in the rewards, the game's unless changed; assigning copies.
    noise_shape : shape (C, N, n) of the standard normals of a step; (C, N + K, n) if a moving
        obstacle has noise.
    low, high : (N, m) the box around all of an agent's control sets, zero where it has no input.
    """

    def __init__(
        self,
        game: Game,
        rules: Rules | None = None,
        copies: int = 1,
        seed: Any = 0,
        randomize: Randomize | None = None,
    ) -> None:
        check_simulation(game, rules, copies)
        self.game, self.rules = game, (Rules() if rules is None else rules).of(game)
        self._tables: Tables = make_tables(game, self.rules)
        self._linked: Any = None
        N, n = self.tables.start.shape
        C, m, self.copies = copies, self.tables.limits.shape[2], copies
        self.entries = DrawnEntries(randomize, game)
        self.observation_size = observation_size(game) + self.entries.size
        self.action_size = m
        self.low, self.high = action_boxes(game)
        self._sizes = [agent.control_dim for agent in game.agents]
        self._action = np.zeros((C, N, m))
        bodies = N + len(self.tables.path)
        self.bodies = np.zeros((C, bodies, n))
        self.status = np.zeros((C, N), dtype=np.int8)
        self.parked = np.zeros((C, N), dtype=np.int64)
        self.alive = np.zeros((C, N), dtype=np.bool_)
        self.clock = np.zeros(C, dtype=np.int64)
        self._lam = np.tile([agent.lam for agent in game.agents], (C, 1))
        self._before = np.zeros(self.bodies.shape if self.tables.swept else (0, 0, 0))
        self.noise_shape = C, bodies if self.tables.drifting else N, n
        self._noise, self._normals = np.zeros(self.noise_shape), Normals()
        self._start_noise = np.zeros(self.noise_shape)
        self._all = np.ones(C, dtype=np.bool_)
        self._was_reset = False
        self.last = make_step(C, N, len(game.encounters), self.observation_size)
        self.variation: Variation | None = None
        self.seed(seed)
        self.randomize = randomize

    @property
    def tables(self) -> Tables:
        """The game and its rules as the kernel reads them."""
        return self._tables

    @tables.setter
    def tables(self, tables: Tables) -> None:
        if self._linked is None or not all(map(is_, tables, self._tables)):
            self._tables, self._linked = tables, None

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change holds from the next episodes on."""
        return self._randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        self.entries.require_same(DrawnEntries(rule, self.game))
        if rule is not None or self.variation is not None:
            self._varied().adopt(rule)
        self._randomize = rule

    @property
    def state(self) -> np.ndarray:
        """States of all agents (C, N, n), a view."""
        return self.bodies[:, : self.status.shape[1]]

    @property
    def lam(self) -> np.ndarray:
        """Weights of time (C, N)."""
        return self._lam

    @lam.setter
    def lam(self, weights: Any) -> None:
        self._lam[:] = weights

    @property
    def max_cycles(self) -> int:
        """Steps after which an episode is truncated."""
        return self.tables.max_cycles

    @max_cycles.setter
    def max_cycles(self, steps: int) -> None:
        self.rules = replace(self.rules, max_cycles=steps)
        self.tables = self.tables._replace(max_cycles=self.rules.steps(self.game))

    def seed(self, seed: Any) -> None:
        """Restart the noise from one or more whole numbers, a ``SeedSequence``, or None (fresh)."""
        sequence = seed_sequence(seed)
        self.random = np.random.Generator(np.random.SFC64(sequence))
        self._sequence = sequence
        if self.variation is not None:
            self.variation.seed(sequence)

    def reset(
        self,
        chosen: np.ndarray | None = None,
        noise: np.ndarray | None = None,
        options: Any = None,
    ) -> np.ndarray:
        """Reset all copies, or the ``chosen`` (C,) ones; return all observations (C, N, W).

        ``noise`` (standard normals of ``noise_shape``) replaces the simulator's own, as in
        :meth:`step`.  ``options`` are values of these episodes (:mod:`ppg_env.env.reset_options`).

        Raises
        ------
        InputError
            If an argument does not fit, or the options do not make a valid game; nothing has
            changed then.
        """
        chosen = self._all if chosen is None else self._checked_choice(chosen)
        normals = None if noise is None else self._checked_noise(noise)
        given = None if options is None else read_options(self.game, options)
        if given is not None or self.variation is not None:
            self.tables = self._varied().begin(self.tables, chosen, given)
        if normals is None:
            self._draw_starts()
        else:
            self._start_noise[:] = normals
        self._was_reset = True
        compiled_kernel().begin(
            self._link(), chosen, self.bodies, self.status, self.parked, self.alive, self.clock,
            self._start_noise, self.last.observation,
        )  # fmt: skip
        if self.entries.size:
            rows, first = np.flatnonzero(chosen), self.observation_size - self.entries.size
            drawn = self.entries.read(self._varied().values, rows)
            self.last.observation[rows, :, first:] = drawn
        return self.last.observation

    def step(
        self, action: np.ndarray, noise: np.ndarray | None = None, *, restart: bool = True
    ) -> Step:
        """Move every copy by ``action`` (C, N, m), or by one action (N, m) for all copies.

        Actions of agents that are not alive are ignored.
        ``noise`` (standard normals of ``noise_shape``) replaces the simulator's own, for replays.
        With ``restart``, copies whose episode is over are reset in the same step.

        Raises
        ------
        InputError
            If an array has another shape, an input of an agent in traffic is not finite, or the
            simulator has not been reset.  Nothing has moved then.
        """
        if not self._was_reset:
            raise InputError("step", "comes before the first reset", "call reset first")
        action = batch_of_actions(action, self._action)
        kernel = compiled_kernel()
        if not kernel.all_usable(action):
            moving = self.alive & (self.status == TRAFFIC)
            action = without_unusable(action, moving, self._sizes)
        if noise is None:
            noise = self._normals.fill(self.random, self._noise)
        else:
            noise = self._checked_noise(noise)
        inside = restart and self.variation is None  # restarting needs nothing but the kernel
        if inside:
            self._draw_starts()
        out = self.last
        kernel.step(
            self._link(), self.bodies, self._before, self.status, self.parked, self.alive,
            self.clock, self.lam, action, noise, inside, self._start_noise, out.reward,
            out.time_cost, out.safety_cost, out.arrived, out.crashed, out.overlap, out.terminated,
            out.truncated, out.acting, out.over, out.observation, out.final_observation,
        )  # fmt: skip
        if restart and not inside and out.over.any():
            out.final_observation[out.over] = out.observation[out.over]
            self.reset(out.over)
        return out

    def game_of(self, copy: int = 0) -> Game:
        """Return the game that a copy plays in its current episode, without missing agents."""
        return self.game if self.variation is None else self.variation.values.game_of(copy)

    def drawn_state(self, rows: np.ndarray) -> np.ndarray:
        """Return (M, .) float32 the entries of the global state about what the copies drew."""
        if not self.entries.size:
            return np.zeros((len(rows), 0), dtype=np.float32)
        return self.entries.state(self._varied().values, rows).astype(np.float32)

    def view(self, agent: int) -> View:
        """Return what the player of ``agent`` observes; the next step overwrites the arrays."""
        arrived = self.status == ARRIVED
        varied = None if self.variation is None else self.variation.values
        return View(
            observation=self.last.observation[:, agent],
            state=self.state,
            in_traffic=self.status == TRAFFIC,
            parked=arrived if self.tables.stay else np.zeros_like(arrived),
            obstacles=self.bodies[:, self.status.shape[1] :, : self.game.dim],
            clock=self.clock,
            lam=self.lam,
            goal=None if varied is None else varied.goal,
            moved=None if varied is None else varied.moved,
        )

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_linked": None}  # a copy links its own arrays

    def _link(self) -> Any:
        """Return the tables as a structure of the kernel, which shares their arrays."""
        if self._linked is None:
            self._linked = compiled_kernel().link(self._tables)
        return self._linked

    def _varied(self) -> Variation:
        """Return what differs between copies, which is kept from the first call on."""
        if self.variation is None:
            self.variation = Variation(self.game, self.tables, self._lam, self._sequence)
            self.tables = self.variation.values.tables(self.tables)
        return self.variation

    def _checked_choice(self, chosen: Any) -> np.ndarray:
        mask = np.asarray(chosen)
        fits = mask.shape == self._all.shape and mask.dtype == np.bool_
        require(
            fits,
            "chosen",
            f"has the shape {mask.shape} and the type {mask.dtype}",
            f"give {self.copies} truth values, one per copy",
        )
        require(
            self._was_reset or bool(mask.all()),
            "reset",
            "starts only some of the copies before any has started",
            "reset all of them first",
        )
        return mask

    def _checked_noise(self, noise: Any) -> np.ndarray:
        normals = np.ascontiguousarray(noise, dtype=np.float64)
        if normals.shape != self.noise_shape:
            remedy = f"give standard normals of the shape {self.noise_shape}"
            raise InputError("noise", f"has the shape {normals.shape}", remedy)
        return normals

    def _draw_starts(self) -> None:
        if self.tables.random_start:
            self._normals.fill(self.random, self._start_noise)
