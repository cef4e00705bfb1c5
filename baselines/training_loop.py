r"""Training in turns: the loop that every method shares.

A training is a list of turns, each so many rollouts of one learner.  A turn begins from the
learners' parameters alone: its random numbers come from the seed and the turn's number, its
episodes start anew.  So a training that was killed goes on from its last checkpoint and ends bit
for bit where an undisturbed one would have, on the same machine.

Checkpoints are tensors only, read back with ``weights_only``: loading one runs no code.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback

from baselines.vec_env import GameVecEnv
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import game_to_tables
from ppg_env.formats.plan_file import to_json
from ppg_env.game.game import Game
from ppg_env.support.atomic_write import write_atomically

LAST_RATE = 0.05
"""Share of the learning rate that is left at the end; it falls linearly."""


@dataclass(frozen=True)
class Args:
    """What every training takes.

    Attributes
    ----------
    game : what is played; its objective and gains do not matter, learners are paid the risk reward.
    sharing : ``selfish`` or ``social`` rewards.
    lam : range from which each episode draws everybody's lam, which is then observed; None to
        train for the game's own.
    seed : of everything random.
    steps : environment steps of all slots together.
    checkpoint : file to save to after every ``checkpoint_every`` rollouts, and to go on from.
    tensorboard : folder for TensorBoard's logs.
    """

    game: Game
    sharing: str = "selfish"
    lam: tuple[float, float] | None = (0.05, 0.95)
    seed: int = 0
    steps: int = 2_000_000
    checkpoint: Path | None = None
    checkpoint_every: int = 20
    tensorboard: Path | None = None

    def __post_init__(self) -> None:
        many = 10**12
        require(1 <= self.steps <= many, "steps", f"is {self.steps}", f"write 1 to {many}")
        require(0 <= self.seed < 2**32, "seed", f"is {self.seed}", f"write 0 to {2**32 - 1}")
        require(
            self.checkpoint_every >= 1,
            "checkpoint_every",
            f"is {self.checkpoint_every}",
            "write a number of rollouts, one or more",
        )
        if self.lam is not None:
            low, high = self.lam
            require(
                0 <= low <= high < 1,
                "lam",
                f"is drawn from {low:g} to {high:g}",
                "write two numbers with 0 <= low <= high < 1",
            )


@dataclass
class Learner:
    """A stable-baselines3 model, its environment, and the steps of one of its rollouts."""

    model: Any
    env: GameVecEnv
    rollout: int


@dataclass(frozen=True)
class Turn:
    """``rollouts`` rollouts, and the updates after each, of the ``learner``-th learner."""

    learner: int
    rollouts: int


Progress = Callable[[int], None]
"""Called with the environment steps taken since the last call."""


def take_turns(
    args: Args,
    learners: Sequence[Learner],
    turns: Sequence[Turn],
    *,
    prepare: Callable[[], None] = lambda: None,
    before: Callable[[Turn], None] = lambda _turn: None,
    progress: Progress = lambda _steps: None,
) -> None:
    """Play ``turns``, from the checkpoint if there is one.

    ``prepare`` runs once at the very beginning, ``before`` before each turn.

    Raises
    ------
    InputError
        If the checkpoint belongs to another training or cannot be read.
    """
    totals = [sum(t.rollouts for t in turns if t.learner == k) for k in range(len(learners))]
    for learner, total in zip(learners, totals, strict=True):
        _anneal(learner.model, total * learner.rollout)
    with one_thread():
        mark = fingerprint(args, turns)
        first = _restore(args.checkpoint, mark, learners)
        if first == 0:
            _seed(args.seed, 0, learners)
            prepare()
        progress(sum(turn.rollouts * learners[turn.learner].rollout for turn in turns[:first]))
        done, saved = first, 0
        for number in range(first, len(turns)):
            turn = turns[number]
            learner = learners[turn.learner]
            _seed(args.seed, number + 1, [learner])
            before(turn)
            learner.model.set_env(learner.model.get_env())  # its episodes begin anew
            learner.model.learn(
                turn.rollouts * learner.rollout,
                callback=_Watch(progress),
                reset_num_timesteps=False,
                tb_log_name=f"seed{args.seed}_learner{turn.learner}",
            )
            learner.model.logger.dump(learner.model.num_timesteps)  # of the last update
            done, saved = number + 1, saved + turn.rollouts
            if args.checkpoint is not None and (
                saved >= args.checkpoint_every or done == len(turns)
            ):
                _save(args.checkpoint, mark, learners, done)
                saved = 0


def in_pieces(learner: int, rollouts: int, size: int) -> list[Turn]:
    """Turns of one learner of ``size`` rollouts each, the last one shorter."""
    whole = [Turn(learner, size)] * (rollouts // size)
    rest = rollouts % size
    return whole + ([Turn(learner, rest)] if rest else [])


def fingerprint(args: Args, turns: Sequence[Turn]) -> str:
    """What a training depends on, as a short text: its arguments and turns, not its files."""
    known = {
        field.name: getattr(args, field.name)
        for field in fields(args)
        if field.name not in ("game", "checkpoint", "tensorboard")
    }
    # The first word is fixed: checkpoints of earlier releases begin with it.
    text = f"baselines.turns {known} {turns} {to_json(game_to_tables(args.game))}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class _Watch(BaseCallback):
    """Reports progress, and logs what finished episodes cost in the game's own money."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self.progress = progress
        self.ended: list[tuple[float, bool, bool]] = []

    def _on_step(self) -> bool:
        infos, dones = self.locals["infos"], self.locals["dones"]
        for k in np.flatnonzero(dones).tolist():
            info = infos[k]
            self.ended.append((info["cost"], info["is_success"], info["crashed"]))
        self.progress(len(dones))
        return True

    def _on_rollout_end(self) -> None:
        if self.ended:
            means = np.mean(self.ended, axis=0)
            for name, value in zip(("cost", "arrived", "crashed"), means, strict=True):
                self.logger.record(f"game/{name}", float(value))
            self.ended.clear()


def _anneal(model: Any, steps: int) -> None:
    """Let the learning rate fall with the steps of the whole training, not of one turn."""
    rate = model.learning_rate
    model.lr_schedule = lambda _left: rate * max(1 - model.num_timesteps / steps, LAST_RATE)


def _seed(seed: int, turn: int, learners: Sequence[Learner]) -> None:
    number = int(np.random.SeedSequence([seed, turn]).generate_state(1)[0])
    for learner in learners:
        learner.model.set_random_seed(number)  # all of torch, NumPy, the environment


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread, so that sums are taken in one order; small networks are no slower for it."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _save(path: Path, mark: str, learners: Sequence[Learner], turns: int) -> None:
    content = io.BytesIO()
    state = {
        "fingerprint": mark,
        "turns": turns,
        "learners": [_state(learner.model) for learner in learners],
    }
    torch.save(state, content)
    write_atomically(path, content.getvalue())


def _restore(path: Path | None, mark: str, learners: Sequence[Learner]) -> int:
    """Load the checkpoint, if there is one; the number of turns that it is past."""
    if path is None or not path.exists():
        return 0
    try:
        state = torch.load(path, weights_only=True)
        known, turns, saved = state["fingerprint"], state["turns"], state["learners"]
    except Exception as error:  # whatever the unpickler meets in a damaged file
        raise InputError(
            os.fspath(path), f"cannot be read ({type(error).__name__})", "remove it to start anew"
        ) from None
    require(
        known == mark,
        os.fspath(path),
        "is the checkpoint of another training",
        "remove it to start anew, or repeat the command that made it",
    )
    for learner, one in zip(learners, saved, strict=True):
        _load(learner.model, one)
    return int(turns)


def _state(model: Any) -> dict[str, Any]:
    state = {"parameters": model.get_parameters(), "steps": model.num_timesteps}
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        state["buffer"] = {key: torch.as_tensor(array) for key, array in _arrays(buffer).items()}
        state["position"] = [buffer.pos, int(buffer.full)]
    return state


def _load(model: Any, state: dict[str, Any]) -> None:
    model.set_parameters(state["parameters"])
    model.num_timesteps = state["steps"]
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        for key, array in _arrays(buffer).items():
            array[:] = state["buffer"][key].numpy()
        buffer.pos, buffer.full = state["position"][0], bool(state["position"][1])


def _arrays(buffer: ReplayBuffer) -> dict[str, np.ndarray]:
    names = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
    return {name: getattr(buffer, name) for name in names}
