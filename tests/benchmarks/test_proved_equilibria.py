"""``ppg equilibria --prove``: intervals for all equilibria, in the table and as JSON."""

from __future__ import annotations

WORDS = ("equilibria", "parallel", "--horizon", "9", "--runs", "1", "--prove")


def test_the_sampled_equilibria_lie_between_the_best_and_the_worst(ppg):
    done = ppg(*WORDS, "--json")
    report, proved = done.json, done.json["proved"]
    costs = [kind["social_cost"] for kind in report["equilibria"]]
    assert proved["best"][0] <= min(costs) == proved["best"][1]
    assert proved["worst"][0] == max(costs) <= proved["worst"][1]
    assert proved["worst"][1] <= 1.02 * proved["worst"][0]
    low, high = proved["price_of_anarchy"]
    assert 1 - 1e-6 <= low <= high <= 1.02
    assert "worst in" in done.err


def test_the_table_shows_the_intervals(ppg):
    done = ppg(*WORDS)
    assert "best equilibrium" in done.out
    assert "9.0000 to 9.0" in done.out


def test_other_games_are_told_what_proofs_need(ppg):
    done = ppg(*WORDS, "--collisions", "swept")
    assert "two agents without obstacles" in " ".join(done.out.split())
