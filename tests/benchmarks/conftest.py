"""A plan file that several commands read, and a browser to look at pages with."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from benchmarks.cli import main

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


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
def browser() -> Iterator[Browser]:
    """Chromium without a window."""
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip("no Chromium here; install your system's package chromium")
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=program)
        yield chromium
        chromium.close()
