r"""Warm start from feedback policies: the network imitates players made by dynamic programming.

    minimise  mean -log sum_k p_k(x) exp(-|a_k(x) - feedback(x)|^2 / (2 s^2)),
              p = softmax of the gates,   over states x that the network itself visits

A network of several experts (:mod:`baselines.experts`) is fitted as a mixture of normal densities
(Bishop, 1994): experts share the examples out among themselves, and gates separate them.
The feedback players are the optimum for social training, and the equilibrium for selfish training.
In each round the network plays (in the first one the feedback players do), the feedback players
are asked for their actions in the states that it visits, and the network is fitted to the
examples of all rounds: DAgger (Ross, Gordon and Bagnell, 2011).  Some agents are disturbed for
some time, so that the network also learns what to do when another agent deviates.

If lam is drawn from a range, feedback players are computed for :data:`LAMS` values in it, and the
network interpolates between them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import torch

from baselines.export import actor_layers, candidates, mean_action
from baselines.training_loop import Activity, Args, silent
from baselines.vec_env import GameVecEnv
from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.formats.game_file import game_from_tables, game_to_tables
from ppg_env.formats.plan_file import to_json
from ppg_env.game.game import Game
from ppg_env.scenarios.make import override_game

LAMS = 6
"""Values of lam with feedback players of their own, where lam is drawn from a range."""

COPIES, STEPS, ROUNDS = 512, 24, 6
"""Copies of the game, divided among the values of lam; steps of each copy in a round; rounds."""

UPDATES, LAST_UPDATES, BATCH, RATE = 1500, 8000, 1024, 2e-3
"""Updates after each round and after the last one, whose learning rate decreases to zero."""

SPREAD = 0.15
"""Standard deviation of the mixture's densities, in units of the largest control."""

PUSH, PUSHED, CHANGES = 0.5, 0.4, 0.15
"""Disturbances: standard deviation in units of the largest control, share of agents that are
disturbed, and probability of a change at each step."""


class Demonstration(NamedTuple):
    """Copies of the game, and the feedback player of each agent."""

    env: GameVecEnv
    players: Sequence[Player]


class Disturbance:
    """Disturbs actions (C, L, m) of some learners, for some time, by ``push`` (deviation)."""

    def __init__(self, env: GameVecEnv, push: float, random: np.random.Generator) -> None:
        shape = (env.simulator.copies, len(env.learners), env.simulator.action_size)
        self._push, self._random = push, random
        self._way, self._size = np.zeros(shape), np.zeros((*shape[:2], 1))

    def of(self, action: np.ndarray) -> np.ndarray:
        """Return disturbed actions (C L, m) in [-1, 1]."""
        shape, random = action.shape, self._random
        changes = random.random((*shape[:2], 1)) < CHANGES
        self._way = np.where(changes, random.normal(size=shape), self._way)
        pushed = self._push * (random.random(changes.shape) < PUSHED)
        self._size = np.where(changes, pushed, self._size)
        return np.clip(action + self._size * self._way, -1.0, 1.0).reshape(-1, shape[2])


def imitate_feedback(
    model: Any,
    demonstrations: Sequence[Demonstration],
    random: np.random.Generator,
    activity: Activity = silent,
) -> None:
    """Fit the mean policy of ``model`` to the feedback players of ``demonstrations``."""
    optimiser = torch.optim.Adam(
        [value for layer in actor_layers(model) for value in layer.parameters()], lr=RATE
    )
    examples = []
    for k in range(ROUNDS):
        activity(f"imitating feedback players, round {k + 1} of {ROUNDS}")
        for demonstration in demonstrations:
            examples.append(_play(demonstration, model if k > 0 else None, random))
        inputs, targets = (
            torch.as_tensor(np.concatenate(part)) for part in zip(*examples, strict=True)
        )
        last = k == ROUNDS - 1
        _fit(model, optimiser, inputs, targets, LAST_UPDATES if last else UPDATES, last, random)


def make_demonstrations(
    args: Args, learners: Sequence[int], activity: Activity = silent
) -> list[Demonstration]:
    """Return feedback players for each value of lam, in copies of the game with that value.

    Raises
    ------
    InputError
        If dynamic programming does not apply to the game.
    """
    lams: list[float | None] = [None]
    if args.lam is not None:
        lams = list(dict.fromkeys(np.linspace(*args.lam, LAMS).tolist()))
    demonstrations = []
    for k, lam in enumerate(lams):
        game = args.game if lam is None else override_game(args.game, lam=lam)
        own = "" if lam is None else f" for lam {lam:.2g}"
        activity(f"dynamic programming{own}, grid {k + 1} of {len(lams)}")
        players = feedback_players(game, args.sharing, args.tolerance)
        env = GameVecEnv(
            game,
            args.rules,
            max(COPIES // len(lams), 1),
            learners=learners,
            players={i: player for i, player in enumerate(players) if i not in learners},
            weights=None if lam is None else (lam, lam),
            seed=args.seed + k,
        )
        demonstrations.append(Demonstration(env, players))
    return demonstrations


def feedback_players(game: Game, sharing: str, tolerance: float | None) -> list[Player]:
    """Return the feedback optimum of ``game`` if ``sharing`` is social, else the equilibrium."""
    return _solved(to_json(game_to_tables(game)), sharing, tolerance)


@lru_cache(maxsize=LAMS)  # trainings with other seeds have the same teachers
def _solved(tables: str, sharing: str, tolerance: float | None) -> list[Player]:
    from solvers.feedback.grid.dynamic_programming import feedback_equilibrium, feedback_optimum

    solve = feedback_optimum if sharing == "social" else feedback_equilibrium
    game = game_from_tables(json.loads(tables), "game")
    return solve(game, Rules(tolerance=tolerance)).players()


def _play(
    demonstration: Demonstration, model: Any, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs (K, W) that learners met while ``model`` played, and actions (K, m) to take.

    Without a model the feedback players play.
    """
    env, players = demonstration
    shape = (env.simulator.copies, len(env.learners), env.simulator.action_size)
    inputs, targets = [], []
    disturbance = Disturbance(env, PUSH, random)
    observation: Any = env.reset()
    for _ in range(STEPS):
        wanted = np.zeros(shape, dtype=np.float32)
        for k, i in enumerate(env.learners):
            wanted[:, k] = env.normalised(i, players[i].act(env.simulator.view(i)))
        active = env.simulator.view(0).in_traffic[:, env.learners].reshape(-1)
        inputs.append(observation[active])
        targets.append(wanted.reshape(-1, shape[2])[active])
        action = wanted if model is None else _mean(model, observation).reshape(shape)
        observation = env.step(disturbance.of(action))[0]
    return np.concatenate(inputs), np.concatenate(targets)


def _mean(model: Any, inputs: np.ndarray) -> np.ndarray:
    """Return the mean actions (C, m), clipped."""
    with torch.no_grad():
        action: np.ndarray = mean_action(model, torch.as_tensor(inputs)).numpy()
    return np.clip(action, -1.0, 1.0)


def _fit(
    model: Any,
    optimiser: torch.optim.Optimizer,
    inputs: torch.Tensor,
    targets: torch.Tensor,
    updates: int,
    anneal: bool,
    random: np.random.Generator,
) -> None:
    """Take ``updates`` steps of likelihood; with ``anneal`` the rate decreases to zero."""
    for k in range(updates):
        optimiser.param_groups[0]["lr"] = RATE * (1 - k / updates if anneal else 1.0)
        some = torch.as_tensor(random.integers(len(inputs), size=BATCH))
        gates, actions = candidates(model, inputs[some])
        misfit = ((actions - targets[some, None]) ** 2).sum(dim=2) / (2 * SPREAD**2)
        loss = -torch.logsumexp(torch.log_softmax(gates, dim=1) - misfit, dim=1).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
