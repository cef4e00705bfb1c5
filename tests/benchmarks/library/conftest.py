"""A small library of its own, which tests may change."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.library.families.tables import game, walker
from benchmarks.library.families.toml_text import toml_text


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two games: lanes side by side, and a crossing."""
    lanes = [walker([0, 0], [5, 0]), walker([0, 1.5], [5, 1.5])]
    crossing = [walker([0, 2], [4, 2]), walker([2, 0], [2, 4])]
    root = tmp_path / "games"
    for name, agents in (("lanes", lanes), ("crossing", crossing)):
        (root / name).mkdir(parents=True)
        (root / name / "1.toml").write_text(toml_text(name, game(8, agents)))
    return root
