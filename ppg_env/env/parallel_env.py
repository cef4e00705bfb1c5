"""The game as a PettingZoo ``ParallelEnv``; the docstring of the class is its page."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

from ppg_env.env.action_spaces import action_spaces
from ppg_env.env.actions import ActionReader
from ppg_env.env.argument_checks import RULES, check_options
from ppg_env.env.infos import CHOICES as INFOS
from ppg_env.env.infos import InfoReader
from ppg_env.env.observation import global_state
from ppg_env.env.observers import make_observer
from ppg_env.env.randomize import Randomize
from ppg_env.env.rules import Rules, make_rules
from ppg_env.env.seeds import whole_seed
from ppg_env.env.simulator import Simulator
from ppg_env.env.status import MISSING
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game, override_game

RENDER_MODES = ("rgb_array", "human")


class PathPlanningEnv(ParallelEnv):
    r"""A path planning game, played step by step.

    N agents with noisy linear dynamics head for their goals.  In every step all of them move at
    once: x' = A x + B u + w, where u is the action projected on the control set and
    w ~ N(0, noise).  Control sets may change over time; the last one stays in force.

    **Agents** are ``agent_0`` ... ``agent_<N-1>``, in the order of the game; an agent that the
    game file names has that name.  Missing ones (``randomize``) are not among ``agents``.

    **Actions**: ``Box`` of shape (m,), float32, the smallest box around the control set (around
    all of them, if it changes over time), in lengths per step for the paper's dynamics.
    Actions outside the set in force are projected on it (``saturation="clip"``).

    **Observations**: ``Box`` of shape (n + d + 2 + (N - 1)(1 + n),), float32, unbounded, with
    n state and d position components; :mod:`ppg_env.env.observation` lists the entries, and those
    that each moving obstacle adds.  ``observation`` chooses others, with limits
    (:mod:`ppg_env.env.observers`).  ``state()`` is one vector of shape (N n + N + 1,), float32,
    listed there too.

    **Collisions** are overlaps after a step, or in games with ``collisions="swept"`` at any time
    of it (:mod:`ppg_env.env.rules`).

    **Reward** ``risk``: -lam per step in traffic, -(1 - lam) kappa at a crash.  ``margin``:
    -lam per step in traffic, -(1 - lam) (M' - s) per step and encounter in traffic.  Both: minus
    the ``effort`` of the applied input.  With ``sharing="social"`` every agent gets the sum of all
    rewards, to the end of the episode.

    **Life-cycle** (arrivals are settled before collisions):

    ==========================  ==============================================================
    event                       consequence
    ==========================  ==============================================================
    arrival, on_goal="remove"   the agent terminates, its body is removed
    arrival, on_goal="stay"     its body stays parked and can be hit; it terminates with the last
    crash, on_crash="remove"    all agents that overlap terminate, their bodies are removed
    crash, on_crash="continue"  they pay and go on; every step with an overlap is a crash
    no agent left in traffic    all remaining agents terminate, parked ones once obstacles rest
    ``max_cycles`` steps        all remaining agents are truncated
    sharing="social"            no agent terminates before the last: all wait for the sum
    ==========================  ==============================================================

    **Infos**, the same keys, shapes and types at reset and at every step, of each living agent:

    ================  =================================================================
    ``arrived``       whether it has arrived, from the step of the arrival on
    ``crashed``       whether it has crashed, from the step of the crash on
    ``crashed_with``  (N + K,) the agents, then the K obstacles, that it overlaps in this
                      step; with ``infos="names"`` the list of their names
    ``in_traffic``    whether it still moves
    ``outside``       whether the realised state is outside its workspace ``within``,
                      which binds means only
    ``time_cost``     time and effort of the step; minus the selfish reward is this and
                      ``safety_cost``
    ``effort_cost``   the part of ``time_cost`` that is due to effort
    ``safety_cost``   of the agent's own crashes or margins in the step
    ================  =================================================================

    **Reset options** are values of one episode: :mod:`ppg_env.env.reset_options`.

    Parameters
    ----------
    game
        A :class:`~ppg_env.Game`, or what :func:`~ppg_env.make_game` takes.
    render_mode
        ``rgb_array``, ``human`` or None.
    observation
        ``relative``, ``box``, ``neighbours(k=4)``, ``lidar(rays=16)`` or ``state``.
    infos
        ``numbers``, or ``names`` for the names of the bodies in ``crashed_with``; learning
        libraries stack infos, and cannot stack names.
    randomize
        What every episode draws, a :class:`~ppg_env.env.Randomize`; observations then have more
        entries (:mod:`ppg_env.env.drawn_entries`), and agents may be missing from an episode.
    **options
        Rules of play (``arrival``, ``on_goal``, ``on_crash``, ``reward``, ``sharing``,
        ``saturation``, ``tolerance``, ``schedule``, ``max_cycles``; see :mod:`ppg_env.env.rules`)
        and fields of the game (``speed``, ``lam``, ``noise``, ...).

    Raises
    ------
    InputError
        If an option is unknown or has a wrong value, an agent starts inside its arrival region,
        or an action is missing, of the wrong shape, not finite, or of an unknown agent.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - PettingZoo reads it as a plain class attribute
        "name": "path_planning_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": 4,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        game: Game | str | Path = "opposing",
        *,
        render_mode: str | None = None,
        observation: str = "relative",
        infos: str = "numbers",
        randomize: Randomize | None = None,
        **options: Any,
    ) -> None:
        require(infos in INFOS, "infos", f"is {infos!r}", "write " + " or ".join(INFOS))
        require(
            render_mode is None or render_mode in RENDER_MODES,
            "render_mode",
            f"is {render_mode!r}",
            "write " + " or ".join(RENDER_MODES),
        )
        check_options(options, type(self))
        rules = {key: options.pop(key) for key in RULES if key in options}
        base = game if isinstance(game, Game) else make_game(game)
        self.game = override_game(base, **options) if options else base
        self.render_mode = render_mode
        self.possible_agents = list(self.game.agent_names)
        self.agents: list[str] = []
        self._index = {name: i for i, name in enumerate(self.possible_agents)}
        self.simulator = Simulator(
            self.game, make_rules(self.game, **rules), seed=None, randomize=randomize
        )
        self._actions = ActionReader(self.game, self.possible_agents)
        self._infos = InfoReader(self.simulator, self.possible_agents, names=infos == "names")
        spaces = action_spaces(self.game, projected=self.rules.saturation == "clip")
        self.action_spaces = dict(zip(self.possible_agents, spaces, strict=True))
        self._observer = make_observer(self.simulator, observation)
        space = self._observer.space
        self.observation_spaces = {
            name: Box(space.low, space.high, dtype=np.float32) for name in self.possible_agents
        }
        self.state_space = Box(-np.inf, np.inf, self.state().shape, np.float32)
        self._viewer: Any = None
        self._was_reset = False

    @property
    def rules(self) -> Rules:
        """The rules of play."""
        return self.simulator.rules

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change of distributions holds from the next episode on."""
        return self.simulator.randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        self.simulator.randomize = rule

    @property
    def np_random(self) -> np.random.Generator:
        """The generator of all noise, which ``reset(seed)`` restarts."""
        return self.simulator.random

    @property
    def max_cycles(self) -> int:
        """Steps after which an episode is truncated."""
        return self.simulator.max_cycles

    @max_cycles.setter
    def max_cycles(self, steps: int) -> None:
        self.simulator.max_cycles = steps

    def observation_space(self, agent: str) -> Box:
        """Return the observation space of ``agent``, the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Return the action space of ``agent``, the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, dict[str, Any]]]:
        """Start an episode; a ``seed`` fixes the noise and draws of this and of later episodes.

        ``options`` are values of this episode alone (:mod:`ppg_env.env.reset_options`).
        """
        if seed is not None:
            self.simulator.seed(whole_seed(seed))
        observation = self._observer.read(self.simulator.reset(options=options))[0]
        missing = self.simulator.status[0] == MISSING
        self.agents = [a for a, left in zip(self.possible_agents, missing, strict=True) if not left]
        self._was_reset = True
        if self._viewer is not None:
            self._viewer.record(self.simulator)
        if self.render_mode == "human":
            self.render()
        observations = {name: observation[self._index[name]].copy() for name in self.agents}
        return observations, self._infos.at_reset(self.agents)

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, np.ndarray],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Move every living agent; ``actions`` has one entry for each.

        Entries of agents that have left are ignored.
        """
        require(isinstance(actions, dict), "actions", "are not a dict", "write {agent: action}")
        require(self._was_reset, "step", "comes before the first reset", "call reset first")
        acting = self.agents
        if not acting:
            self._actions.check_names(actions)
            return {}, {}, {}, {}, {}
        out = self.simulator.step(self._actions.read(actions, acting), restart=False)
        observation = self._observer.read(out.observation)[0].copy()  # one array for all agents
        reward, over_time = out.reward[0].tolist(), out.truncated[0].tolist()
        ended = out.terminated[0].tolist()
        infos = self._infos.after_step(acting)
        index = self._index
        self.agents = [a for a in acting if not (ended[index[a]] or over_time[index[a]])]
        result = (
            {a: observation[index[a]] for a in acting},
            {a: reward[index[a]] for a in acting},
            {a: ended[index[a]] for a in acting},
            {a: over_time[index[a]] for a in acting},
            infos,
        )
        if self._viewer is not None:
            self._viewer.record(self.simulator)
        if self.render_mode == "human":
            self.render()
        return result

    def state(self) -> np.ndarray:
        """Return the global state, from which alone the game goes on, as a float32 vector."""
        simulator, tables = self.simulator, self.simulator.tables
        share = simulator.clock[:1] / simulator.max_cycles
        state = global_state(
            simulator.bodies[0], simulator.status[0], share, tables.centre, tables.scale
        )
        return np.concatenate([state, simulator.drawn_state(np.zeros(1, dtype=np.int64))[0]])

    def render(self) -> np.ndarray | None:
        """Return an (H, W, 3) uint8 picture for ``rgb_array``; update the window for ``human``."""
        if self.render_mode is None:
            warnings.warn(
                "render() does nothing without a render_mode; make the environment with "
                "render_mode='rgb_array' or 'human'.",
                stacklevel=2,
            )
            return None
        require(self._was_reset, "render", "comes before the first reset", "call reset first")
        if self._viewer is None:
            from ppg_env.env.viewer import Viewer

            self._viewer = Viewer(self.game, self.metadata["render_fps"])
            self._viewer.record(self.simulator)
        if self.render_mode == "human":
            self._viewer.show()
            return None
        return self._viewer.frame()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None
