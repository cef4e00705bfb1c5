"""Files of learned players: what goes in comes out, and nothing in them is executed."""

from __future__ import annotations

import io
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from baselines import Learned, read_learned, write_learned
from ppg_env import Game, InputError, make_game
from ppg_env.formats.game_file import game_to_tables
from tests.baselines.small import small_policy

ROOT = Path(__file__).parents[2]


def about(game: Game, **more: object) -> dict[str, object]:
    return {"player": "test", "game": game_to_tables(game), "lam": None, **more}


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [("player", None, "'player' is not a name"), ("game", "head_on", "'game' is not the tables"),
     ("lam", 0.8, "'lam' is not two limits")],
)  # fmt: skip
def test_what_could_not_be_read_is_not_written(game, tmp_path, key, value, words) -> None:
    players = Learned(((small_policy(game), None),), {**about(game), key: value})
    with pytest.raises(InputError, match=words):
        write_learned(tmp_path / "file.npz", players)
    assert not (tmp_path / "file.npz").exists()


@pytest.fixture
def file(game: Game, tmp_path: Path) -> Path:
    team = (small_policy(game), None)
    return write_learned(tmp_path / "file.npz", Learned((team, (None, None)), about(game)))


def test_what_is_written_is_read_back(game: Game, tmp_path: Path) -> None:
    shared = (small_policy(game, 1, conditioned=True),)
    each = (small_policy(game, 2, squash=True), None)
    given = Learned((shared, each), about(game, lam=[0.1, 0.9], seeds=[1, 2]))
    read = read_learned(write_learned(tmp_path / "a.npz", given))
    assert read.runs == given.runs
    assert read.about["seeds"] == [1, 2]
    assert read.name == "test"
    again = write_learned(tmp_path / "b.npz", read)
    assert again.read_bytes() == (tmp_path / "a.npz").read_bytes()


def test_which_games_it_fits(game: Game, tmp_path: Path) -> None:
    fixed = Learned(((None,),), about(game))
    ranged = Learned(((None,),), about(game, lam=[0.2, 0.6]))
    assert fixed.fits(game)
    assert fixed.fits(make_game("intersection", speed="l1", gain=0.0, objective="risk"))
    assert not fixed.fits(make_game("intersection", speed="l1", lam=0.4))
    assert ranged.fits(make_game("intersection", speed="l1", lam=0.4))
    assert not ranged.fits(make_game("intersection", speed="l1", lam=0.7))
    assert not ranged.fits(make_game("intersection", speed="l1", lam=[0.3, 0.4]))
    for other in (
        make_game("intersection"),
        make_game("head_on", speed="l1"),
        make_game("intersection3", speed="l1"),
        make_game("intersection", speed="l1", noise=1.0),
        make_game("intersection", speed="l1", horizon=16),
        make_game("intersection", speed="l1", crash_cost=10.0),
    ):
        assert not ranged.fits(other)


class Bomb:
    """Leaves a mark when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


def test_pickled_objects_are_refused_unread(file: Path, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    with np.load(file) as arrays:
        content = dict(arrays)
    for name in ("about", "run0_agent0_weight0"):
        stream = io.BytesIO()
        bomb = np.empty(1, dtype=object)
        bomb[0] = Bomb(mark)
        np.savez(stream, **{**content, name: bomb})
        bad = tmp_path / "bad.npz"
        bad.write_bytes(stream.getvalue())
        with pytest.raises(InputError, match=r"bad\.npz: cannot be read"):
            read_learned(bad)
    bad.write_bytes(pickle.dumps(Bomb(mark)))
    with pytest.raises(InputError, match=r"bad\.npz: cannot be read"):
        read_learned(bad)
    assert not mark.exists()


def test_damaged_files_are_reported_in_one_sentence(file: Path, tmp_path: Path) -> None:
    data, bad = file.read_bytes(), tmp_path / "bad.npz"
    for content in (b"", b"junk", data[: len(data) // 2], data[:-10], data[100:]):
        bad.write_bytes(content)
        with pytest.raises(InputError, match=r"bad\.npz"):
            read_learned(bad)
    with pytest.raises(InputError, match="does not exist"):
        read_learned(tmp_path / "none.npz")
    with pytest.raises(InputError):
        read_learned(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        {"format": "other"},
        {"version": 3},
        {"runs": []},
        {"runs": [[]]},
        {"runs": [[{"layers": 9}]]},
        {"runs": [[{"layers": "x", "activation": "tanh"}]]},
        {"runs": 3},
        {"player": None},
        {"game": 1},
        {"lam": 0.5},
    ],
    ids=str,
)
def test_a_text_that_does_not_fit_is_refused(file: Path, tmp_path: Path, change) -> None:
    with np.load(file) as arrays:
        content = dict(arrays)
    about = json.loads(str(content["about"])) | change
    bad = tmp_path / "bad.npz"
    np.savez(bad, **(content | {"about": np.array(json.dumps(about))}))
    with pytest.raises(InputError, match=r"bad\.npz"):
        read_learned(bad)


def test_playing_needs_no_torch(file: Path) -> None:
    code = f"""
import sys
from baselines import read_learned
from ppg_env import make_game
from ppg_env.env import episodes
game = make_game("intersection", speed="l1")
players = read_learned({str(file)!r}).players(game)
print(episodes.evaluate(game, players, 100).cost.shape)
assert "torch" not in sys.modules and "stable_baselines3" not in sys.modules
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.stdout == "(100, 2)\n", done.stderr
