"""Where machine code is kept, and that processes that start together compile once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from numba.core import caching, config

from ppg_env.support import compilation

SCRIPT = """
import sys

import numpy as np

from ppg_env.support.compilation import njit

@njit(cache=True)
def total(n):
    s = 0.0
    for k in range(n):
        s += k ** 0.5
    return s

assert total(getattr(np, sys.argv[1])(4)) > 4.1
print(sum(total.stats.cache_misses.values()))
"""


def test_the_lock_is_exclusive_and_waits_no_longer_than_asked(tmp_path: Path) -> None:
    path = str(tmp_path / "lock")
    with compilation.locked(path) as first, compilation.locked(path, patience=0.0) as second:
        assert (first, second) == (True, False)
    with compilation.locked(path, patience=0.0) as third:
        assert third


def test_a_folder_without_locks_is_no_obstacle(tmp_path: Path) -> None:
    with compilation.locked(str(tmp_path / "missing" / "lock")) as locked:
        assert not locked


def test_users_are_told_once(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compilation._announced.clear()
    compilation._say(compilation.COMPILING)
    compilation._say(compilation.WAITING)
    assert capsys.readouterr().err.count("about a minute") == 1
    compilation._announced.clear()
    monkeypatch.setattr(sys, "stderr", None)
    compilation._say(compilation.COMPILING)


@pytest.fixture
def unwritable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Neither the source's folder nor the user's is writable."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.setattr(compilation.tempfile, "gettempdir", lambda: str(tmp_path))
    compilation._temporary_folder.cache_clear()
    for locator in (caching.InTreeCacheLocator, caching.UserWideCacheLocator):
        monkeypatch.setattr(locator, "from_function", classmethod(lambda *_: None))
    yield tmp_path
    compilation._temporary_folder.cache_clear()


def test_code_is_kept_in_a_private_folder_where_no_other_is_writable(unwritable: Path) -> None:
    dispatcher = compilation.njit(cache=True)(_twice)
    (folder,) = unwritable.iterdir()
    assert folder.stat().st_mode & 0o077 == 0
    assert str(folder) in dispatcher.stats.cache_path
    assert str(folder) == config.CACHE_DIR


def test_the_folder_of_somebody_else_is_not_used(unwritable: Path, monkeypatch: Any) -> None:
    user = compilation.os.getuid()
    (unwritable / f"ppg_env-{user}").mkdir(mode=0o777)
    (unwritable / f"ppg_env-{user}").chmod(0o777)
    monkeypatch.setattr(compilation.tempfile, "tempdir", str(unwritable))
    dispatcher = compilation.njit(cache=True)(_twice)
    assert f"ppg_env-{user}/" not in dispatcher.stats.cache_path


@pytest.mark.parametrize("made", [False, True], ids=["no folder", "read-only folder"])
def test_code_is_kept_in_memory_where_no_folder_is_writable(
    unwritable: Path, monkeypatch: pytest.MonkeyPatch, made: bool
) -> None:
    def nowhere() -> str:
        raise FileNotFoundError("No usable temporary directory found")

    if made:
        monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", _refuse)
    else:
        monkeypatch.setattr(compilation.tempfile, "gettempdir", nowhere)
    dispatcher = compilation.njit(cache=True)(_twice)
    assert dispatcher(2.0) == 4.0
    assert not dispatcher.stats.cache_path
    compilation._announced.clear()
    said: list[str] = []
    monkeypatch.setattr(compilation, "_say", said.append)
    compilation._announce(dispatcher)
    assert said == [compilation.IN_MEMORY]


def _refuse(_locator: Any) -> None:
    raise OSError("Read-only file system")


def _twice(x: float) -> float:
    return 2 * x


class Removed(NamedTuple):
    value: float


def _value_of(pair: Any) -> Any:
    return pair[0]


def test_code_of_a_release_with_other_classes_is_compiled_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    before = compilation.njit(cache=True)(_value_of)
    assert before(Removed(2.0)) == 2.0
    assert str(tmp_path) in before.stats.cache_path
    monkeypatch.delattr(sys.modules[__name__], "Removed")
    after = compilation.njit(cache=True)(_value_of)
    assert after((3.0, 4.0)) == 3.0
    assert sum(after.stats.cache_misses.values()) == 1


def misses(folder: Path, *kinds: str) -> list[int]:
    """How often each of the processes that start together compiles, one for each kind of number."""
    script = folder / "script.py"
    if not script.exists():
        script.write_text(SCRIPT)
    processes = [
        subprocess.Popen([sys.executable, str(script), kind], stdout=subprocess.PIPE, text=True)
        for kind in kinds
    ]
    return [int(process.communicate()[0]) for process in processes]


@pytest.mark.slow
def test_processes_that_start_together_compile_once(tmp_path: Path) -> None:
    assert sorted(misses(tmp_path, "int64", "int64", "int64")) == [0, 0, 1]


@pytest.mark.slow
def test_processes_that_compile_other_signatures_keep_the_code_of_each_other(
    tmp_path: Path,
) -> None:
    kinds = ("int64", "int32", "uint8")
    assert misses(tmp_path, *kinds) == [1, 1, 1]
    assert misses(tmp_path, *kinds) == [0, 0, 0]
