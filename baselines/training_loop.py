"""Training in turns: the loop that every method shares.

A training is a list of turns; a turn is a number of rollouts of one learner.  A turn depends on the
learners' parameters alone: its random numbers come from the seed and the turn's number, and its
episodes start from the beginning.  A training that was killed therefore continues from its last
checkpoint and ends, on the same machine, with the same bits as an undisturbed one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from baselines.checkpoint import restore_checkpoint, save_checkpoint
from baselines.vec_env import GameVecEnv
from ppg_env.env.randomize import Randomize
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.formats.game_file import game_to_tables
from ppg_env.formats.plan_file import to_json
from ppg_env.game.game import Game

LAST_RATE = 0.05
"""Final share of the learning rate, which decreases linearly."""


@dataclass(frozen=True)
class Args:
    """Arguments of every training method.

    Attributes
    ----------
    game : the game; its objective and gains are ignored, learners receive the risk reward.
    sharing : ``selfish`` or ``social`` rewards.
    lam : range from which each episode draws one lam for all agents, which they observe; None to
        train for the game's own.
    seed : random seed.
    steps : environment steps of all slots together.
    checkpoint : file to save to after every ``checkpoint_every`` rollouts, and to continue from.
    tensorboard : folder for TensorBoard's logs.
    tolerance : of arrival regions, see :class:`ppg_env.env.Rules`.
    imitate_feedback : whether the network first imitates feedback players, not straight ways.
    randomize : what every episode draws and agents observe; lam only if ``lam`` is None.
    """

    game: Game
    sharing: str = "selfish"
    lam: tuple[float, float] | None = (0.05, 0.95)
    seed: int = 0
    steps: int = 2_000_000
    checkpoint: Path | None = None
    checkpoint_every: int = 20
    tensorboard: Path | None = None
    tolerance: float | None = None
    imitate_feedback: bool = False
    randomize: Randomize | None = None

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

    @property
    def rules(self) -> Rules:
        """The rules of play."""
        return Rules(sharing=self.sharing, tolerance=self.tolerance)


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

Activity = Callable[[str], None]
"""Called with what a training does before its first step, and with an empty text at that step."""


def silent(_text: str) -> None:
    """Ignore what a training does."""


def take_turns(
    args: Args,
    learners: Sequence[Learner],
    turns: Sequence[Turn],
    *,
    prepare: Callable[[], None] = lambda: None,
    before: Callable[[Turn], None] = lambda _turn: None,
    progress: Progress = lambda _steps: None,
) -> None:
    """Take ``turns``, from the checkpoint if there is one.

    ``prepare`` runs once at the beginning, ``before`` runs before each turn.

    Raises
    ------
    InputError
        If the checkpoint belongs to another training or cannot be read.
    """
    totals = [sum(t.rollouts for t in turns if t.learner == k) for k in range(len(learners))]
    for learner, total in zip(learners, totals, strict=True):
        _anneal(learner.model, total * learner.rollout)
    with one_thread():
        models, mark = [learner.model for learner in learners], fingerprint(args, turns)
        first = restore_checkpoint(args.checkpoint, mark, models)
        if first == 0:
            _seed(args.seed, 0, learners)
            prepare()
        progress(sum(turn.rollouts * learners[turn.learner].rollout for turn in turns[:first]))
        unsaved = 0
        for done, turn in enumerate(turns[first:], first + 1):
            _seed(args.seed, done, [learners[turn.learner]])
            before(turn)
            _learn(args, learners[turn.learner], turn, progress)
            unsaved += turn.rollouts
            due = unsaved >= args.checkpoint_every or done == len(turns)
            if args.checkpoint is not None and due:
                save_checkpoint(args.checkpoint, mark, models, done)
                unsaved = 0


def _learn(args: Args, learner: Learner, turn: Turn, progress: Progress) -> None:
    """Take one turn, from new episodes."""
    learner.model.set_env(learner.model.get_env())
    learner.model.learn(
        turn.rollouts * learner.rollout,
        callback=_Watch(progress),
        reset_num_timesteps=False,
        tb_log_name=f"seed{args.seed}_learner{turn.learner}",
    )
    learner.model.logger.dump(learner.model.num_timesteps)  # of the last update


def in_pieces(learner: int, rollouts: int, size: int) -> list[Turn]:
    """Return turns of one learner of ``size`` rollouts each; the last may be shorter."""
    whole = [Turn(learner, size)] * (rollouts // size)
    rest = rollouts % size
    return whole + ([Turn(learner, rest)] if rest else [])


def fingerprint(args: Args, turns: Sequence[Turn]) -> str:
    """Return a hash of what a training depends on: its arguments and turns, not its files."""
    later = (
        "tolerance",
        "imitate_feedback",
        "randomize",
    )  # without them, checkpoints of earlier releases fit
    arguments = {
        field.name: getattr(args, field.name)
        for field in fields(args)
        if field.name not in ("game", "checkpoint", "tensorboard")
        and (field.name not in later or getattr(args, field.name) != field.default)
    }
    # The first word is frozen: checkpoints of earlier releases begin with it.
    text = f"baselines.turns {arguments} {turns} {to_json(game_to_tables(args.game))}"
    text += " experts" if args.imitate_feedback else ""  # networks without them do not fit
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class _Watch(BaseCallback):
    """Reports progress, and logs the costs of finished episodes in the game's own units."""

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
    """Decrease the learning rate over the steps of the whole training, not of one turn."""
    rate = model.learning_rate
    model.lr_schedule = lambda _left: rate * max(1 - model.num_timesteps / steps, LAST_RATE)


def _seed(seed: int, turn: int, learners: Sequence[Learner]) -> None:
    number = int(np.random.SeedSequence([seed, turn]).generate_state(1)[0])
    for learner in learners:
        learner.model.set_random_seed(number)  # all of torch, NumPy, the environment


@contextmanager
def one_thread() -> Iterator[None]:
    """Use one thread, so that sums have one order; small networks are no slower."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
