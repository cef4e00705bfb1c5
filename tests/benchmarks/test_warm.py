"""``ppg warm``: machine code is compiled ahead."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.mark.slow
def test_warm_compiles_for_every_usual_size_once_and_says_where(ppg):
    result = ppg("warm", "head_on", "--json").json
    sizes = [(row["position_components"], row["state_components"]) for row in result["sizes"]]
    assert sizes == [(2, 2), (3, 3), (1, 1)]
    assert any(Path(result["folder"]).glob("kernel.step-*.nbi"))


def test_warm_refuses_a_game_that_does_not_exist(ppg):
    assert "nowhere" in ppg("warm", "nowhere", code=2).err
