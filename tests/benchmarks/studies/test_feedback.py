"""Players that observe all agents: cells, prices and regrets from rows, and what they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from baselines import evaluate_runs, find_pretrained
from benchmarks import sweeps
from benchmarks.studies.feedback import data, findings, measures, study, tables
from ppg_env import make_game
from solvers.feedback.grid import joint_model
from tests.benchmarks.studies.conftest import SMALL, STEP, crashing


def row(player, cost, crash=0.01, lam=0.5, gains=None):
    """A row whose groups differ a little, by the same noise for all players."""
    noise = np.linspace(-0.01, 0.01, 5)
    limits = {"expected_cost_low": cost - 0.1, "expected_cost_high": cost + 0.1}
    regrets = None if gains is None else [{"value": g, "low": g - 0.01, "high": g} for g in gains]
    return crashing(
        0.9 * crash, crash, 1.1 * crash, player=player, speed="l1", scenario="toy", lam=lam,
        status="", episodes=1000, expected_cost=cost, **limits,
        group_costs=list(cost + noise), group_crashes=list(crash * (1 + noise)),
        **({} if regrets is None else {"play_regret": regrets}),
    )  # fmt: skip


ROWS = [
    row("nash", 10.0, 0.1, gains=(0.5, 2.0)),
    row("social", 9.0, 0.01),
    row("feedback-nash", 8.2, 0.02, gains=(0.0, 0.041)),
    row("feedback-social", 8.0, 0.005),
    row("ppo-selfish", 8.4, 0.004, gains=(0.42, 0.1)),
    row("ppo-social", 8.04, 0.008),
]


def test_cells_have_all_players_and_regrets_of_selfish_ones():
    cells = data.cells(SMALL)
    assert tuple(cell.player for cell in cells) == data.PLAYERS
    assert not any(cell.deviation for cell in cells)
    assert {(cell.arena, cell.groups) for cell in cells} == {("env", data.GROUPS)}
    measured = data.cells(replace(SMALL, lams=data.REGRET_LAMS))
    assert {cell.player for cell in measured if cell.deviation} == set(data.SELFISH)


def test_three_agents_have_no_grid():
    cells = data.cells(replace(SMALL, scenarios=("intersection3",)))
    assert [cell.player for cell in cells] == ["nash", "social", "ppo-selfish", "ppo-social"]
    assert not any(cell.deviation for cell in cells)


def test_prices_compare_groups_with_the_same_noise():
    (own,) = measures.by_game(ROWS).values()
    cost = measures.ratio(own["nash"], own["social"], "costs")
    assert cost.value == pytest.approx(10 / 9, rel=1e-4)
    assert cost.high - cost.low < 1e-3
    assert measures.ratio(own["nash"], own["social"], "crashes").value == pytest.approx(10)
    never = row("social", 9.0, 0.0)
    assert measures.ratio(own["nash"], never, "crashes").value == pytest.approx(1000, rel=1e-3)
    gap = measures.difference(own["ppo-social"], own["feedback-social"])
    assert (gap.value, gap.low, gap.high) == pytest.approx((0.04, 0.04, 0.04))


def test_the_regret_is_the_largest_gain_over_the_cost():
    (own,) = measures.by_game(ROWS).values()
    assert measures.regret(own["nash"]).value == pytest.approx(0.2)
    assert measures.regret(own["feedback-nash"]).value == pytest.approx(0.005)
    assert measures.regret(own["social"]) is None


def test_sentences_say_what_the_rows_say():
    failed = {"scenario": "toy", "player": "nash", "reason": "no time"}
    said = list(findings.findings([*ROWS, failed]))
    text = "".join(said)
    assert "Planned (nash compared with social): costs differ by at most 5% in 0 of 1" in said[0]
    assert "more likely in 1, less likely in 0 (median ratio 10, largest 10)" in said[0]
    assert "as the paper reports, in 1 game (toy l1 0.5)" in said[1]
    assert "more likely in 0, less likely in 1" in said[2]
    assert "None of the 5 other results in 1 games is significantly cheaper" in said[3]
    assert "social costs 12.5% more than feedback-social" in said[4]
    assert "ppo-social costs 0.5% more" in said[5]
    assert "feedback-nash compared with social, same noise: cheaper in 1 of 1" in text
    assert "ppo-selfish compared with feedback-nash, same noise: cheaper in 0 of 1" in text
    assert "nash 20.0% of the cost in the median of 1 games" in said[-2]
    assert "feedback-nash 0.5% of the cost" in said[-2]
    assert "1 plans are missing" in said[-1]
    cheap = findings.findings([*ROWS[:-1], row("ppo-social", 7.9)])
    assert "1 of the 5 other results in 1 games (ppo-social at toy l1 0.5) is" in "".join(cheap)


def test_tables_mark_ratios_that_noise_explains():
    costs, crashes, prices, regrets = tables.tables(ROWS)
    assert costs.lines[0][3] == "10.000 ± 0.100"
    assert crashes.lines[0][3] == "1.0e-1"
    assert prices.lines[0][3:] == ("1.111", "1.025", "1.045", "10", "4", "0.5")
    assert regrets.lines[0][3] == "20.00% ± 0.05%"
    noisy = row("ppo-social", 8.04) | {"group_crashes": [0.0, 0.02, 0.0, 0.01, 0.01]}
    assert list(tables.tables([*ROWS[:-1], noisy]))[2].lines[0][-1].startswith("(")


@pytest.mark.slow
def test_limits_of_learners_cover_their_runs(whole):
    rows = {stored.player: stored for stored in whole(study.STUDY)}
    stored, kept = rows["ppo-social"], data.digest(rows["ppo-social"])
    assert kept["expected_cost_low"] < stored.expected_cost_low
    game = make_game("intersection", speed="l1", lam=0.8, objective="risk")
    learned = find_pretrained("ppo-social", game)
    runs = [learned.players(game, run) for run in range(data.GROUPS)]
    again = evaluate_runs(game, runs, SMALL.episodes, SMALL.seed)
    assert kept["group_costs"] == pytest.approx(again.costs.tolist())


@pytest.mark.slow
def test_regrets_of_all_agents_are_measured_and_kept(monkeypatch, tmp_path):
    monkeypatch.setattr(joint_model, "default_step", lambda *_: STEP)
    nash = data.cells(replace(SMALL, lams=data.REGRET_LAMS))[0]
    (stored,) = sweeps.sweep([nash], tmp_path / "rows.db")
    gains = data.digest(stored)["play_regret"]
    assert [set(gain) for gain in gains] == [{"value", "low", "high"}] * 2
    assert all(0 <= gain["low"] <= gain["value"] <= gain["high"] for gain in gains)
