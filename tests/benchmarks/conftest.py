"""The command ``ppg``, run in this process."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from baselines import Learned, write_learned
from benchmarks.cli import main
from ppg_env import make_game
from ppg_env.formats.game_file import game_to_tables
from tests.baselines.conftest import small_policy


@dataclass(frozen=True)
class Run:
    """What a command left behind: exit code, stdout, stderr."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Stdout as one strict JSON object."""
        found = json.loads(self.out, parse_constant=_refuse)
        assert isinstance(found, dict)
        return found


Ppg = Callable[..., Run]


@pytest.fixture
def ppg(capsys: pytest.CaptureFixture[str]) -> Ppg:
    """Run ``ppg`` with these words, and expect this exit code."""

    def run(*words: object, code: int = 0) -> Run:
        capsys.readouterr()
        left = 0
        try:
            main([str(word) for word in words])
        except SystemExit as leave:
            left = leave.code or 0
        captured = capsys.readouterr()
        done = Run(left, captured.out, captured.err)
        assert done.code == code, done.err
        return done

    return run


@pytest.fixture(scope="session")
def plan_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The social optimum of a crossing under heavy noise, as ``ppg solve --out`` writes it."""
    path = tmp_path_factory.mktemp("plans") / "plan.json"
    words = ["solve", "intersection", "--solution", "social", "--noise", "40", "--out", str(path)]
    with pytest.raises(SystemExit) as leave:
        main(words)
    assert not leave.value.code
    return path


@pytest.fixture(scope="session")
def learned_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Players of two agents with random weights, as a training would leave them."""
    game = make_game("intersection", speed="l1")
    about = {"player": "random", "game": game_to_tables(game), "lam": None}
    learned = Learned(((small_policy(game, 0),), (small_policy(game, 1),)), about)
    return write_learned(tmp_path_factory.mktemp("learned") / "random.npz", learned)


def _refuse(word: str) -> None:
    raise AssertionError(f"{word} is not JSON")
