"""TorchRL's view of a game: many copies in one simulator, agents in groups.

    env = GameTorchRLEnv("head_on", 64)
    data = env.rollout(100, break_when_any_done=False)              # batch size (64, 100)

Names are those of TorchRL's PettingZoo environment with ``use_mask=True``, which BenchMARL reads as
well.  Agents called ``<stem>_<number>`` form the group ``<stem>``; if all have the stem ``agent``,
or names differ from that, there is one group, ``agents``.  For C copies and a group of G agents:

========================  =========  ============================================================
entry                     shape      meaning
========================  =========  ============================================================
``group, "observation"``  (C, G, W)  see :mod:`ppg_env.env.observation`
``group, "action"``       (C, G, m)  inputs; an agent with fewer than m ignores the last ones
``group, "reward"``       (C, G, 1)  as in the environment, or shaped and scaled
                                     (:mod:`baselines.shaping`); 0 after the agent's end
``group, "mask"``         (C, G)     whether the agent still acts
``group, "terminated"``   (C, G, 1)  whether the agent has arrived or crashed, or no agent is
                                     left in traffic; set until the copy ends
``group, "truncated"``    (C, G, 1)  whether its time is over
``group, "done"``         (C, G, 1)  either of the two
``group, "info", ...``    (C, G, 1)  ``arrived`` and ``crashed``: whether it has; ``in_traffic``;
                                     ``time_cost`` and ``safety_cost`` of the step
``"done"``                (C, 1)     whether all agents' episodes have ended
``"truncated"``           (C, 1)     the same, where the time of an agent is over
``"terminated"``          (C, 1)     the same, elsewhere
``"state"``               (C, S)     the global state, with ``return_state``
========================  =========  ============================================================

A copy is reset in the step in which its last agent ends (``step_and_maybe_reset``, on which
collectors rely): ``"next"`` holds the last observation, the following step starts with the first
one.  Agents that end earlier keep their last flags, and their actions are ignored; those that are
missing from an episode (``randomize``) have no mask, and are terminated from its first step on.
Until it is reset, a copy whose episode is over stays as it is.  All tensors are the caller's to
keep.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from baselines.shaping import RewardShaping
from ppg_env.env.argument_checks import check_batch_options
from ppg_env.env.observation import global_state
from ppg_env.env.observers import make_observer
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.randomize import Randomize
from ppg_env.env.simulator import Simulator
from ppg_env.env.status import ARRIVED, MISSING, TRAFFIC
from ppg_env.game.game import Game

try:
    import torch
    from tensordict import TensorDict, TensorDictBase
    from torchrl.data import Categorical, Composite
    from torchrl.envs import EnvBase
    from torchrl.envs.utils import MarlGroupMapType

    from baselines.torchrl_specs import (
        box,
        checked_action,
        flags,
        group_agents,
        padded_boxes,
        reals,
        selection,
    )
except ImportError as missing:
    sentence = "GameTorchRLEnv: needs TorchRL; install path-planning-games[torchrl]."
    raise ImportError(sentence) from missing

FLAGS = ("done", "terminated", "truncated")
EVENTS = ("arrived", "crashed", "in_traffic")
COSTS = ("time_cost", "safety_cost")


class GameTorchRLEnv(EnvBase):
    """``copies`` of a game as a TorchRL environment of batch size (copies,).

    Parameters
    ----------
    game, observation, randomize, **options
        As in :class:`~ppg_env.PathPlanningEnv`.
    copies
        Number of copies.
    group_map
        Names of agents by group, or a ``MarlGroupMapType``; by default groups of equal stems.
    return_state
        Whether the global state is an entry.
    shaping
        Whether rewards are shaped by the time still needed (:mod:`baselines.shaping`).
    reward_scale
        Rewards are divided by it.
    seed
        Fixes all noise, as does ``set_seed``; None for fresh entropy.
    device
        Where tensors are; the simulation runs on the CPU.

    Attributes
    ----------
    game : the game, with its fields replaced by the options.
    agent_names : names of the N agents, in the order of the game.
    group_map : names of agents by group.
    simulator : the :class:`~ppg_env.Simulator` of all copies; its ``observation_size`` is the
        number of entries of an observation of kind ``relative``, its ``action_size`` the number of
        inputs m, and its ``low`` and ``high`` (N, m) are the boxes around the control sets.

    Raises
    ------
    InputError
        If an option or an action does not fit, or a step comes before a reset.
    """

    batch_locked = True

    def __init__(
        self,
        game: Game | str | Path = "opposing",
        copies: int = 1,
        *,
        observation: str = "relative",
        randomize: Randomize | None = None,
        group_map: MarlGroupMapType | Mapping[str, Sequence[str]] | None = None,
        return_state: bool = False,
        shaping: bool = False,
        reward_scale: float = 1.0,
        seed: int | None = None,
        device: Any = "cpu",
        **options: Any,
    ) -> None:
        check_batch_options(options, type(self))
        single = PathPlanningEnv(game, randomize=randomize, **options)
        simulator = Simulator(single.game, single.rules, copies, seed, randomize)
        super().__init__(device=device, batch_size=[copies])
        self.game, self.simulator = single.game, simulator
        self.agent_names = single.possible_agents
        self.group_map = group_agents(group_map, self.agent_names)
        places = {name: i for i, name in enumerate(self.agent_names)}
        self._members = {
            group: selection([places[name] for name in names])
            for group, names in self.group_map.items()
        }
        self._observer = make_observer(simulator, observation)
        self._returns_state = return_state
        self._shaping = RewardShaping(simulator, shaping, reward_scale)
        shape = simulator.status.shape
        self._actions = np.zeros(simulator.low.shape, dtype=np.float32)[None].repeat(copies, 0)
        self._arrived, self._crashed, self._terminated, self._truncated = (
            np.zeros(shape, dtype=np.bool_) for _ in range(4)
        )
        self._make_specs(single.state_space.shape)

    def _make_specs(self, state_shape: tuple[int, ...]) -> None:
        """Set the specs, from the spaces of all agents."""
        simulator, C = self.simulator, self.batch_size[0]
        space = self._observer.space
        low, high = padded_boxes(simulator)
        observation, action, reward, done = (Composite(shape=(C,)) for _ in range(4))
        done.update(flags((C, 1), FLAGS))
        for group, own in self._members.items():
            G = len(self.group_map[group])
            own_low, own_high = low[own], high[own]
            info = flags((C, G, 1), EVENTS) | {key: reals((C, G, 1)) for key in COSTS}
            observation[group] = Composite(
                {
                    "observation": box(space.low, space.high, (C, G, *space.shape)),
                    "mask": Categorical(2, shape=(C, G), dtype=torch.bool),
                    "info": Composite(info, shape=(C, G)),
                },
                shape=(C, G),
            )
            inputs = box(own_low, own_high, (C, *own_low.shape))
            action[group] = Composite({"action": inputs}, shape=(C, G))
            reward[group] = Composite({"reward": reals((C, G, 1))}, shape=(C, G))
            done[group] = Composite(flags((C, G, 1), FLAGS), shape=(C, G))
        if self._returns_state:
            observation["state"] = reals((C, *state_shape))
        device = self.device
        self.observation_spec, self.action_spec = observation.to(device), action.to(device)
        self.reward_spec, self.done_spec = reward.to(device), done.to(device)

    @property
    def randomize(self) -> Randomize | None:
        """What every episode draws; a change of distributions holds from the next episodes on."""
        return self.simulator.randomize

    @randomize.setter
    def randomize(self, rule: Randomize | None) -> None:
        self.simulator.randomize = rule

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.game.name or 'game'!r}, copies={self.batch_size[0]})"

    def _set_seed(self, seed: int | None) -> None:
        self.simulator.seed(seed)

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        """Reset all copies, or those of the entry ``"_reset"``."""
        chosen = np.ones(self.batch_size[0], dtype=np.bool_)
        wanted = None if tensordict is None else tensordict.get("_reset", None)
        if wanted is not None:
            chosen = wanted.reshape(self.batch_size).cpu().numpy()
        self.simulator.reset(chosen)
        self._arrived[chosen] = self.simulator.status[chosen] == ARRIVED
        for happened in (self._crashed, self._terminated, self._truncated):
            happened[chosen] = False
        return self._result(self._observed(chosen))

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Step the copies whose episode is not over, or those of the entry ``"_step"``."""
        simulator, chosen = self.simulator, tensordict.get("_step", None)
        moving: Any = simulator.alive.any(axis=1)
        if chosen is not None:
            moving &= chosen.reshape(self.batch_size).cpu().numpy()
        for group, own in self._members.items():
            given = tensordict.get((group, "action"), None)
            self._actions[:, own] = checked_action(given, group, self._actions[:, own].shape)
        self._shaping.before_step()
        with self._resting(~moving):
            out = simulator.step(self._actions, restart=False)
        if not moving.all():
            for changes in (out.reward, out.arrived, out.crashed, out.terminated, out.truncated):
                changes[~moving] = 0
        self._arrived |= out.arrived
        self._crashed |= out.crashed
        self._terminated |= out.terminated | (simulator.status == MISSING)
        self._truncated |= out.truncated
        values = self._observed(~moving)
        rewards = self._shaping.rewards(out.observation)
        values["reward"] = rewards.astype(np.float32)[..., None]
        return self._result(values)

    @contextmanager
    def _resting(self, still: np.ndarray) -> Iterator[None]:
        """Keep the copies that are ``still`` (C,) as they are."""
        simulator = self.simulator
        changed: tuple[np.ndarray, ...] = (
            simulator.bodies, simulator.status, simulator.parked, simulator.alive, simulator.clock,
            simulator.last.observation,
        )  # fmt: skip
        kept = [values[still] for values in changed] if still.any() else []
        yield
        for values, before in zip(changed, kept, strict=False):
            values[still] = before

    def _observed(self, free: np.ndarray) -> dict[str, Any]:
        """Return (C, N, ...) all entries but rewards; copies that are ``free`` have no costs."""
        simulator, last = self.simulator, self.simulator.last
        costs = [getattr(last, key).astype(np.float32)[..., None] for key in COSTS]
        for cost in costs:
            cost[free] = 0.0
        ended = self._terminated | self._truncated
        events = (self._arrived, self._crashed, simulator.status == TRAFFIC)
        return {
            "observation": self._observer.read(last.observation),
            "mask": ~ended & (simulator.status != MISSING),
            "info": {key: value[..., None] for key, value in zip(EVENTS, events, strict=True)}
            | dict(zip(COSTS, costs, strict=True)),
            "done": ended[..., None],
            "terminated": self._terminated[..., None],
            "truncated": self._truncated[..., None],
        }

    def _result(self, values: dict[str, Any]) -> TensorDictBase:
        """Return the entries ``values`` (C, N, ...) by group, with those of whole copies."""
        shape = self.batch_size
        entries: dict[str, Any] = {
            group: _tensors(values, own, (*shape, len(self.group_map[group])))
            for group, own in self._members.items()
        }
        done = values["done"].all(axis=1)
        truncated = done & values["truncated"].any(axis=1)
        ends = zip(FLAGS, (done, done & ~truncated, truncated), strict=True)
        entries |= {key: torch.from_numpy(flag) for key, flag in ends}
        if self._returns_state:
            simulator, tables = self.simulator, self.simulator.tables
            share = simulator.clock[:, None] / simulator.max_cycles
            state = global_state(
                simulator.bodies, simulator.status, share, tables.centre, tables.scale
            )
            drawn = simulator.drawn_state(np.arange(shape[0]))
            entries["state"] = torch.from_numpy(np.concatenate([state, drawn], axis=1))
        return TensorDict(entries, batch_size=shape, device=self.device)


def _tensors(values: Mapping[str, Any], own: Any, shape: tuple[int, ...]) -> TensorDictBase:
    """Return copies of ``values`` (C, N, ...) of a group as tensors."""
    entries = {
        key: _tensors(value, own, shape)
        if isinstance(value, Mapping)
        else torch.from_numpy(value[:, own].copy())
        for key, value in values.items()
    }
    return TensorDict(entries, batch_size=shape)
