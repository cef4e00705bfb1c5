r"""A trained policy as plain arrays, and its player; needs NumPy alone.

x = observation, what episodes drew if the policy observes it, and lam if it is conditioned on it
x <- activation(W x + b)         hidden layers
y = W x + b                      the last layer: an action, or with K experts
                                 K gates and K actions, of which the largest gate chooses y
a = clip(y, -1, 1), or tanh of it
u = middle + half * a            the box around all of the agent's control sets

If the control set changes over time the box stays the same, and the environment projects u on the
current set.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env.env.drawn_entries import OBSERVED, DrawnEntries, OwnValues
from ppg_env.env.observation import observation_size
from ppg_env.env.players import Player, View, straight_players
from ppg_env.env.randomize import Near, Randomize
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.input_sets import bounds
from ppg_env.support.frozen import Record

ACTIVATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
}


@dataclass(frozen=True, eq=False)
class Policy(Record):
    """A feed-forward network from observations to actions in [-1, 1].

    Attributes
    ----------
    weights, biases : one (outputs, inputs) and one (outputs,) float32 array per layer.
    activation : of the hidden layers, ``tanh`` or ``relu``.
    squash : whether the last layer ends in tanh; else it is clipped.
    conditioned : whether lam is the last input.
    drawn : fields of a :class:`~ppg_env.env.Randomize` that are inputs, after the observation.
    shared : those among them of which one value holds for all agents.
    experts : how many actions the last layer proposes; if several, their gates come first.
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]
    activation: str = "tanh"
    squash: bool = False
    conditioned: bool = False
    drawn: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    experts: int = 1

    def __post_init__(self) -> None:
        require(
            self.activation in ACTIVATIONS,
            "activation",
            f"is {self.activation!r}",
            "write " + " or ".join(ACTIVATIONS),
        )
        for field in self.drawn:
            require(field in OBSERVED, "drawn", f"names {field!r}", "use " + ", ".join(OBSERVED))
        for name in ("weights", "biases"):
            layers = tuple(np.array(layer, dtype=np.float32) for layer in getattr(self, name))
            for layer in layers:
                layer.setflags(write=False)
                require(
                    bool(np.isfinite(layer).all()), name, "are not finite", "train the policy again"
                )
            object.__setattr__(self, name, layers)
        width = self.inputs if self.weights and self.weights[0].ndim == 2 else 0
        fits = bool(width) and len(self.weights) == len(self.biases)
        for weight, bias in zip(self.weights, self.biases, strict=False):
            fits = fits and weight.ndim == 2 and weight.shape == (bias.size, width)
            width = bias.size
        fits = fits and self.experts >= 1 and self.outputs >= 1 and width == self._last_width
        require(fits, "weights", "do not fit together", "give one matrix and one vector per layer")

    @property
    def inputs(self) -> int:
        """Width of the first layer."""
        return self.weights[0].shape[1]

    @property
    def outputs(self) -> int:
        """Number of action components."""
        return self.biases[-1].size // self.experts - self._gated

    @property
    def _gated(self) -> bool:
        return self.experts > 1

    @property
    def _last_width(self) -> int:
        return self.experts * (self.outputs + self._gated)

    def entries(self, game: Game) -> DrawnEntries:
        """Return the inputs about what is drawn, of agents of ``game``."""
        fields: dict[str, Any] = dict.fromkeys(self.drawn, Near(0.0))
        return DrawnEntries(Randomize(**fields, shared=self.shared), game)

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """Return actions (C, m) in [-1, 1] for inputs (C, W) float32."""
        activate, x = ACTIVATIONS[self.activation], inputs
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = activate(x @ weight.T + bias)
        x = x @ self.weights[-1].T + self.biases[-1]
        if self._gated:
            proposed = x[:, self.experts :].reshape(len(x), self.experts, self.outputs)
            x = proposed[np.arange(len(x)), x[:, : self.experts].argmax(axis=1)]
        return np.tanh(x) if self.squash else np.clip(x, -1.0, 1.0)


Team = tuple[Policy | None, ...]
"""One policy per agent, None for the straight plan; all agents share a single one."""


class LearnedPlayer:
    """Plays a policy for one agent, without exploration."""

    information = "full state"

    def __init__(self, game: Game, agent: int, policy: Policy) -> None:
        mover = game.agents[agent]
        self._agent, self.policy = agent, policy
        self._size = mover.control_dim
        self._observed, drawn = observation_size(game), policy.entries(game)
        own = drawn.read(OwnValues(game), np.zeros(1, dtype=np.int64))
        self._own = own[0, agent].astype(np.float32)
        entries = self._observed + drawn.size + policy.conditioned
        require(
            policy.inputs == entries and policy.outputs >= self._size,
            "policy",
            f"has {policy.inputs} inputs and {policy.outputs} outputs where agent {agent} of this "
            f"game has {entries} and {self._size}",
            "play it in a game of the size it was trained in",
        )
        low, high = bounds(mover.control)
        self._middle, self._half = (high + low) / 2, (high - low) / 2

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m) of the mean policy; zero where the agent is out of traffic."""
        active = np.flatnonzero(view.in_traffic[:, self._agent])  # other actions are ignored
        action = np.zeros((len(view.observation), self._size))
        action[active] = self.actions(view.observation[active], view.lam[active, self._agent])
        return action

    def actions(self, observations: np.ndarray, lam: np.ndarray) -> np.ndarray:
        """Return actions (C, m) for observations (C, W) of an agent with weights ``lam`` (C,)."""
        inputs = self._seen(observations)
        if self.policy.conditioned:
            inputs = np.concatenate([inputs, lam[:, None].astype(np.float32)], axis=1)
        return self._middle + self._half * self.policy(inputs)[:, : self._size]

    def _seen(self, seen: np.ndarray) -> np.ndarray:
        """Return observations (C, W) and what was drawn; it is the game's own if not observed."""
        size = self._observed + self._own.size
        if size > seen.shape[1] == self._observed:
            own = np.broadcast_to(self._own, (len(seen), self._own.size))
            return np.concatenate([seen, own], axis=1)
        require(
            seen.shape[1] == size or not self._own.size,
            "policy",
            f"observes {size} entries, and the environment has {seen.shape[1]}",
            "play it where the fields are drawn that it was trained with, or none",
        )
        return seen[:, :size]


def team_players(game: Game, team: Team) -> Sequence[Player]:
    """Return the players of a team, one per agent of ``game``.

    Raises
    ------
    InputError
        If the team has neither one policy nor one per agent, or a policy does not fit.
    """
    count = len(game.agents)
    require(
        len(team) in (1, count),
        "policy",
        f"is for {len(team)} agents, and the game has {count}",
        "play it in a game of the size it was trained in",
    )
    each = team * count if len(team) == 1 else team
    return [
        straight if policy is None else LearnedPlayer(game, i, policy)
        for i, (policy, straight) in enumerate(zip(each, straight_players(game), strict=True))
    ]
