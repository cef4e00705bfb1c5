"""A small reproduction, and a browser to look at its page with."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

from benchmarks.reproduction.grid import Extent, Setting
from benchmarks.reproduction.run import Reproduction, reproduce

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the small reproduction keeps its cells."""
    return tmp_path_factory.mktemp("reproduction") / "small.db"


@pytest.fixture(scope="session")
def found(store: Path) -> Reproduction:
    """Two scenarios in one setting at three lam."""
    extent = Extent(
        settings=(Setting("l1", 3.0),),
        scenarios=("head_on", "intersection"),
        lams=(0.3, 0.6, 0.8),
        episodes=200,
    )
    return reproduce(extent, store)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium without a window."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip("no Chromium here; install your system's package chromium")
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=program)
        yield chromium
        chromium.close()
