"""The game as a PettingZoo ``ParallelEnv``; its page is the docstring of the class."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

from ppg_env.env.rules import CHOICES, make_rules
from ppg_env.env.simulator import Simulator
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import AGENT_KEYS, GAME_KEYS
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game, override_game

RULES = (*CHOICES, "tolerance", "schedule", "max_cycles")
RENDER_MODES = ("rgb_array", "human")


class PathPlanningEnv(ParallelEnv):
    r"""A path planning game, played step by step.

    N agents with noisy linear dynamics head for their goals; every step all of them move at once:
    x' = A x + B u + w, with u the action projected on the control set and w ~ N(0, noise).  Control
    sets may change over time; the last one holds for ever.

    **Agents** are ``agent_0`` ... ``agent_<N-1>``, in the order of the game.

    **Actions**: ``Box`` of shape (m,), float32, the smallest box around the control set (around
    all of them, where it changes over time), in lengths per step for the paper's dynamics.
    Actions outside the set that holds at the step are projected on it (``saturation="clip"``).

    **Observations**: ``Box`` of shape (n + d + 2 + (N - 1)(1 + n),), float32, unbounded, lengths
    divided by ``scale`` (half the largest extent of starts and goals).  n state and d position
    components; for d = n = 2:

    ======================  =====  ==================================================
    entry                   size   meaning
    ======================  =====  ==================================================
    state - goal            n      where the goal is
    position - centre       d      where in the field
    in traffic              1      1 until arrival or crash
    time                    1      share of ``max_cycles`` gone
    other: there            1      1 if its body can be hit, else it and the rest are 0
    other: relative state   n      position less one's own; other components as they are
    ======================  =====  ==================================================

    the last two for each other agent, in the order of the game.

    ``state()`` is one vector of shape (N n + N + 1,), float32: all positions less the centre and
    the other state components, divided by ``scale``; who is in traffic; the time share.

    **Reward** ``risk``: -lam per step in traffic, -(1 - lam) kappa at a crash.  ``margin``:
    -lam - (1 - lam) sum (M' - s) per step in traffic, over all encounters in traffic before the
    move.  ``sharing="social"`` gives everybody the sum of all rewards, to the end of the episode.

    **Life-cycle** (arrivals are settled before collisions):

    ==========================  =======================================================
    event                       what happens
    ==========================  =======================================================
    arrival, on_goal="remove"   the agent terminates, its body is gone
    arrival, on_goal="stay"     its body stays parked, can be hit; it terminates with the last
    crash, on_crash="remove"    all who overlap terminate, their bodies are gone
    crash, on_crash="continue"  they pay and go on, for every step that ends in overlap
    nobody left in traffic      everybody still there terminates
    ``max_cycles`` steps        everybody still there is truncated
    sharing="social"            nobody terminates before the last: they wait for the sum
    ==========================  =======================================================

    **Infos**, per living agent and step: ``arrived``, ``crashed`` (bool), ``crashed_with`` (names
    of agents, ``obstacle_<k>``), ``in_traffic``, ``time_cost``, ``safety_cost`` (its own terms;
    the selfish reward is minus their sum).

    Parameters
    ----------
    game
        A :class:`~ppg_env.Game`, or what :func:`~ppg_env.make_game` takes.
    render_mode
        ``rgb_array``, ``human`` or None.
    **options
        Rules of play (``arrival``, ``on_goal``, ``on_crash``, ``reward``, ``sharing``,
        ``saturation``, ``tolerance``, ``schedule``, ``max_cycles``; see :mod:`ppg_env.env.rules`)
        and fields of the game (``speed``, ``lam``, ``noise``, ...).

    Raises
    ------
    InputError
        If an option is unknown or has a wrong value, or an action is missing, of the wrong
        shape, or not finite.
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
        **options: Any,
    ) -> None:
        require(
            render_mode is None or render_mode in RENDER_MODES,
            "render_mode",
            f"is {render_mode!r}",
            "write " + " or ".join(RENDER_MODES),
        )
        known = (*RULES, "speed", "obstacles", *GAME_KEYS, *AGENT_KEYS)
        for key in options:
            require(key in known, key, "is not an option", "use one of " + ", ".join(known))
        rules = {key: options.pop(key) for key in RULES if key in options}
        made = game if isinstance(game, Game) else make_game(game)
        self.game = override_game(made, **options) if options else made
        self.rules = make_rules(self.game, **rules)
        self.render_mode = render_mode
        self.possible_agents = [f"agent_{i}" for i in range(len(self.game.agents))]
        self.agents: list[str] = []
        self._index = {name: i for i, name in enumerate(self.possible_agents)}
        self.simulator = Simulator(self.game, self.rules, seed=None)
        low, high, size = self.simulator.low, self.simulator.high, self.simulator.observation_size
        self._actions = np.zeros((1, *low.shape))
        self.observation_spaces = {
            name: Box(-np.inf, np.inf, (size,), np.float32) for name in self.possible_agents
        }
        self.action_spaces = {
            name: Box(
                low[i, : agent.control_dim].astype(np.float32),
                high[i, : agent.control_dim].astype(np.float32),
            )
            for i, (name, agent) in enumerate(
                zip(self.possible_agents, self.game.agents, strict=True)
            )
        }
        self.state_space = Box(-np.inf, np.inf, self._state_vector().shape, np.float32)
        self._partners = self._name_encounters()
        self._viewer: Any = None
        self._begun = False

    @property
    def max_cycles(self) -> int:
        """Steps after which an episode is truncated."""
        return self.simulator.tables.max_cycles

    @max_cycles.setter
    def max_cycles(self, steps: int) -> None:
        self.rules = make_rules(self.game, **(vars(self.rules) | {"max_cycles": steps}))
        self.simulator.tables = self.simulator.tables._replace(max_cycles=steps)

    def observation_space(self, agent: str) -> Box:
        """The same space object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """The same space object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, dict[str, Any]]]:
        """Begin an episode; a ``seed`` fixes all of its noise and that of later episodes."""
        if seed is not None:
            whole = isinstance(seed, (int, np.integer)) and seed >= 0
            require(whole, "seed", f"is {seed!r}", "give a whole number that is not negative")
            self.simulator.seed(int(seed))
        observation = self.simulator.reset()[0]
        self.agents, self._begun = self.possible_agents[:], True
        if self._viewer is not None:
            self._viewer.record(self.simulator)
        if self.render_mode == "human":
            self.render()
        quiet = {"crashed": False, "time_cost": 0.0, "safety_cost": 0.0}
        arrived = (self.simulator.status[0] != 0).tolist()
        return (
            {name: observation[i].copy() for name, i in self._index.items()},
            {
                name: quiet | {"crashed_with": [], "arrived": there, "in_traffic": not there}
                for name, there in zip(self.agents, arrived, strict=True)
            },
        )

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, np.ndarray],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Move every living agent; ``actions`` names each of them."""
        require(isinstance(actions, dict), "actions", "are not a dict", "write {agent: action}")
        require(self._begun, "step", "comes before the first reset", "call reset first")
        acting = self.agents
        if not acting:
            require(not actions, "actions", "are given though nobody is left", "call reset first")
            return {}, {}, {}, {}, {}
        self._read(actions)
        out = self.simulator.step(self._actions, restart=False)
        observation = out.observation[0]
        reward, over_time = out.reward[0].tolist(), out.truncated[0].tolist()
        ended = out.terminated[0].tolist()
        infos = self._infos(acting)
        index = self._index
        self.agents = [a for a in acting if not (ended[index[a]] or over_time[index[a]])]
        result = (
            {a: observation[index[a]].copy() for a in acting},
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
        """Everything that the game's future depends on, as one float32 vector."""
        return self._state_vector()

    def render(self) -> np.ndarray | None:
        """An (H, W, 3) uint8 picture for ``rgb_array``; a window for ``human``."""
        if self.render_mode is None:
            import warnings

            warnings.warn(
                "render() does nothing without a render_mode; make the environment with "
                "render_mode='rgb_array' or 'human'.",
                stacklevel=2,
            )
            return None
        require(self._begun, "render", "comes before the first reset", "call reset first")
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

    def _read(self, actions: dict[str, Any]) -> None:
        for name in self.agents:
            if name not in actions:
                raise InputError(f"actions[{name!r}]", "is missing", "give one for each of agents")
            self._read_one(name, actions[name])
        if len(actions) != len(self.agents):
            strange = next(name for name in actions if name not in self.agents)
            known = "has left the game" if strange in self._index else "is no agent"
            raise InputError(f"actions[{strange!r}]", known, "give actions for env.agents only")

    def _read_one(self, name: str, action: Any) -> None:
        i = self._index[name]
        size = self.game.agents[i].control_dim
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.array(np.nan)
        if values.shape != (size,) or not np.isfinite(values).all():
            raise InputError(
                f"actions[{name!r}]",
                f"is {action!r}, not {size} finite numbers",
                f"give an array of shape ({size},)",
            )
        self._actions[0, i, :size] = values

    def _infos(self, acting: list[str]) -> dict[str, dict[str, Any]]:
        out, index = self.simulator.last, self._index
        arrived, crashed = out.arrived[0].tolist(), out.crashed[0].tolist()
        time, safety = out.time_cost[0].tolist(), out.safety_cost[0].tolist()
        traffic = (self.simulator.status[0] == 0).tolist()
        infos = {}
        for name in acting:
            i = index[name]
            infos[name] = {
                "arrived": arrived[i],
                "crashed": crashed[i],
                "crashed_with": self._hit(i) if crashed[i] else [],
                "in_traffic": traffic[i],
                "time_cost": time[i],
                "safety_cost": safety[i],
            }
        return infos

    def _hit(self, agent: int) -> list[str]:
        overlap = self.simulator.last.overlap[0]
        return [name for e, name in self._partners[agent] if overlap[e]]

    def _name_encounters(self) -> list[list[tuple[int, str]]]:
        """For each agent, the encounters it is in and the other side's name."""
        named: list[list[tuple[int, str]]] = [[] for _ in self.possible_agents]
        for e, encounter in enumerate(self.game.encounters):
            if encounter.obstacle is not None:
                named[encounter.agents[0]].append((e, f"obstacle_{encounter.obstacle}"))
                continue
            i, j = encounter.agents
            named[i].append((e, self.possible_agents[j]))
            named[j].append((e, self.possible_agents[i]))
        return named

    def _state_vector(self) -> np.ndarray:
        simulator, tables = self.simulator, self.simulator.tables
        away = simulator.state[0].copy()
        away[:, : self.game.dim] -= tables.centre
        traffic = simulator.status[0] == 0
        share = simulator.clock[0] / tables.max_cycles
        return np.concatenate([away.ravel() / tables.scale, traffic, [share]]).astype(np.float32)
