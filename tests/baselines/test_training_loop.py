"""Trainings repeat bit for bit, and one that was killed ends where it would have anyway."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from baselines import ppo_per_agent as separate
from baselines import ppo_shared, sac_single
from baselines.training_loop import Args, Turn, fingerprint, in_pieces
from ppg_env import Game, InputError, make_game
from tests.baselines.small import ROLLOUT
from tests.marks import first

ROOT = Path(__file__).parents[2]
METHODS = {  # functions, and steps for several turns and checkpoints of a shortened training
    "shared": (ppo_shared.train, 4 * ROLLOUT),
    "independent": (separate.independent, 4 * ROLLOUT),
    "best-response": (separate.best_response, 16 * ROLLOUT),
    "off-policy": (sac_single.train, 5 * 320),
}


class KilledError(Exception):
    """Stands for whatever stops a training."""


@pytest.mark.usefixtures("short_trainings")
@pytest.mark.parametrize("method", first(1, METHODS))
def test_a_training_repeats_and_goes_on_after_a_kill(
    game: Game, tmp_path: Path, method: str
) -> None:
    train, steps = METHODS[method]
    args = Args(game, steps=steps, seed=3, checkpoint_every=1)
    undisturbed = train(args)
    path = tmp_path / "seed.pt"
    args = replace(args, checkpoint=path)
    taken = 0

    def until(limit: int):
        def progress(more: int) -> None:
            nonlocal taken
            taken += more
            if taken > limit:
                raise KilledError

        return progress

    for share in (0.3, 0.55, 0.8):
        taken = 0
        with pytest.raises(KilledError):
            train(args, until(int(share * steps)))
        assert path.exists()
    taken = 0
    resumed = train(args, until(2 * steps))
    assert resumed == undisturbed
    assert taken >= steps  # what was done before is reported too
    assert train(replace(args, checkpoint=None, seed=4)) != undisturbed
    assert train(args, until(2 * steps)) == undisturbed  # finished: nothing is done again


KILLED = """
import os, signal, sys
import pytest
from baselines import training_loop
from benchmarks.cli import main
from tests.baselines.small import shorten_trainings

rollouts = 0

def end_rollout(watch):
    global rollouts
    rollouts += 1
    if rollouts == 25:
        os.kill(os.getpid(), signal.SIGKILL)

shorten_trainings(pytest.MonkeyPatch())
training_loop._Watch._on_rollout_end = end_rollout
main(sys.argv[1:])
"""
"""A training whose process dies five rollouts after its only checkpoint."""


@pytest.mark.slow
@pytest.mark.usefixtures("short_trainings")
def test_sigkill_loses_nothing_but_the_last_interval(ppg, tmp_path: Path) -> None:
    out, whole = tmp_path / "out.npz", tmp_path / "whole.npz"
    words = ["train", "intersection", "--speed", "l1", "--steps", str(30 * ROLLOUT), "--out"]
    kept = tmp_path / "out.npz.checkpoints" / "seed-0.pt"
    killed = subprocess.run([sys.executable, "-c", KILLED, *words, str(out)], cwd=ROOT, check=False)
    assert killed.returncode == -signal.SIGKILL
    assert kept.exists()
    assert not out.exists()
    assert "continuing" in ppg(*words, out).err
    assert not kept.parent.exists()
    ppg(*words, whole)
    with np.load(out) as one, np.load(whole) as two:
        assert one.files == two.files
        for name in one.files:
            if name != "about":
                np.testing.assert_array_equal(one[name], two[name])


@pytest.mark.usefixtures("short_trainings")
def test_a_checkpoint_of_another_training_is_refused(game: Game, tmp_path: Path) -> None:
    args = Args(game, steps=8192, checkpoint=tmp_path / "seed.pt")
    ppo_shared.train(args)
    for other in (
        replace(args, seed=1),
        replace(args, sharing="social"),
        replace(args, lam=None),
        replace(args, game=make_game("intersection", speed="l1", noise=1.0)),
    ):
        with pytest.raises(InputError, match="another training"):
            ppo_shared.train(other)
    with pytest.raises(InputError, match="another training"):
        separate.independent(args)


@pytest.mark.usefixtures("short_trainings")
def test_a_damaged_checkpoint_is_reported_and_runs_no_code(game: Game, tmp_path: Path) -> None:
    import pickle

    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "mark"),)

    path = tmp_path / "seed.pt"
    for content in (b"junk", b"", pickle.dumps(Bomb())):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"seed\.pt: cannot be read"):
            ppo_shared.train(Args(game, steps=8192, checkpoint=path))
    assert not (tmp_path / "mark").exists()


def test_pieces_add_up() -> None:
    assert in_pieces(0, 7, 3) == [Turn(0, 3), Turn(0, 3), Turn(0, 1)]
    assert in_pieces(1, 6, 3) == [Turn(1, 3), Turn(1, 3)]
    assert in_pieces(0, 2, 3) == [Turn(0, 2)]


def test_files_do_not_change_what_a_training_is(game: Game, tmp_path: Path) -> None:
    args, turns = Args(game), [Turn(0, 1)]
    same = (replace(args, tensorboard=tmp_path), replace(args, checkpoint=tmp_path / "a.pt"))
    for other in same:
        assert fingerprint(other, turns) == fingerprint(args, turns)
    assert fingerprint(replace(args, seed=1), turns) != fingerprint(args, turns)
    assert fingerprint(args, [Turn(0, 2)]) != fingerprint(args, turns)


@pytest.mark.parametrize(
    "mistake",
    [{"steps": 0}, {"seed": -1}, {"checkpoint_every": 0}, {"lam": (0.5, 0.2)}, {"lam": (0.5, 1)}],
    ids=str,
)
def test_arguments_that_cannot_be_are_refused(game: Game, mistake) -> None:
    with pytest.raises(InputError, match=next(iter(mistake))):
        Args(game, **mistake)
