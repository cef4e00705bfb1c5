"""Sweeps: rows in the order of cells, once each, on every backend."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.comparison.compare import compare
from benchmarks.comparison.results import comparison_report
from benchmarks.sweeps import Cell, Store, run, sweep
from benchmarks.sweeps.run import part, play
from benchmarks.sweeps.workers import Died, each_done
from ppg_env import InputError, make_game
from ppg_env.formats.game_file import game_from_tables, game_to_toml
from ppg_env.game.polytope import Polytope
from solvers import best_response_dynamics
from solvers.planner_options import PlannerOptions
from tests.benchmarks.sweeps.conftest import quick, timeless

ROOT = Path(__file__).parents[3]


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "rows.db"


def test_a_row_says_what_compare_says(store):
    fields = {"speed": "l1", "lam": 0.8, "objective": "risk"}
    (row,) = sweep([Cell("head_on", "social", fields, episodes=3000, seed=4)], store)
    game = make_game("head_on", **fields)
    rows = compare(game, ["social"], 3000, PlannerOptions(seed=4))
    (reported,) = comparison_report(game, rows, "schedule", 3000, 4)["rows"]
    assert row.arrival == reported["arrival"]
    assert row.shifted_cost == list(reported["shifted_cost"])
    assert row.social_cost == reported["social_cost"]
    estimate = reported["crash_probability"]
    assert (row.crash_probability, row.crash_probability_high) == (
        estimate["value"],
        estimate["high"],
    )
    assert row.expected_cost == reported["expected_cost"]["value"]
    assert row.value == row.social_cost >= row.bound
    assert (row.scenario, row.lam, row.lams, row.speed, row.gain) == (
        "head_on", 0.8, [0.8, 0.8], "l1", 0.5,
    )  # fmt: skip


def test_a_row_has_what_json_has_no_form_for(store):
    slower = [(0, Polytope.box([20.0, 20.0])), (5, Polytope.box([18.0, 18.0]))]
    fields = {"control": slower, "noise": np.diag([1.0, 2.0]), "gain": {0: 0.25}}
    cell = Cell("parallel", "straight", fields, episodes=10)
    (row,) = sweep([cell], store)
    assert not row.failed
    assert (row.speed, row.noise, row.gain, row.lam) == ("box", None, None, 0.5)
    assert row.fields["noise"] == [[1.0, 0.0], [0.0, 2.0]]
    assert game_from_tables(row.game, "row") == cell.game
    assert sweep([cell], store) == [row]


def test_start_and_order_reach_the_planner(store):
    cell = Cell("head_on", "nash", {"speed": "l1"}, start="sequential", order=(1, 0), episodes=10)
    (row,) = sweep([cell], store)
    found = best_response_dynamics(cell.game, start="sequential", order=(1, 0))
    assert row.controls == [plan.controls.tolist() for plan in found.profile]
    (other,) = sweep([replace(cell, order="cyclic", start=None)], store)
    assert other.means != row.means
    assert (row.start, row.order) == ("sequential", "1,0")


@pytest.mark.slow
def test_groups_give_planners_the_noise_of_learners(store):
    base = Cell("parallel", "ppo-social", {"speed": "l1"}, arena="env", episodes=100, groups=5)
    learned, planned = sweep([base, replace(base, player="social")], store)
    assert (learned.runs, planned.runs) == (5, 1)
    assert learned.over_runs is not None
    game = base.game
    rows = compare(game, ["ppo-social", "social"], 100, PlannerOptions(), arena="env")
    assert [learned.expected_cost, planned.expected_cost] == [
        row.played.expected_cost.value for row in rows
    ]


def test_stored_cells_are_not_run_again(store, monkeypatch):
    cells, counts = quick(4), []
    first = sweep(cells[:2], store)
    again = sweep(cells, store, progress=counts.append)
    assert counts == [2, 1, 1]
    assert again[:2] == first
    monkeypatch.setattr(run, "play", lambda _: pytest.fail("all rows are stored"))
    assert sweep(cells[::-1], store) == again[::-1]
    assert sweep([cells[0]] * 2, store) == [first[0]] * 2


def test_shards_are_a_partition(store):
    cells = quick(11)
    shards = [part(cells, k, 3) for k in (1, 2, 3)]
    assert sorted(map(len, shards)) == [3, 4, 4]
    found = {cell.address for shard in shards for cell in shard}
    assert found == {cell.address for cell in cells}
    assert [c for c in cells if c in shards[1]] == shards[1]
    assert part(cells[::-1], 2, 3) == shards[1][::-1]  # whatever the order
    for wrong in [(0, 3), (4, 3), (1, 0)]:
        with pytest.raises(InputError, match="shard"):
            part(cells, *wrong)


def test_shards_merged_are_the_whole(store, tmp_path):
    cells = quick(5)
    whole = sweep(cells, store)
    with Store(tmp_path / "all.db") as base:
        for k in (1, 2):
            sweep(cells, tmp_path / f"{k}.db", shard=(k, 2))
            base.merge(tmp_path / f"{k}.db")
        assert timeless(base.rows()) == timeless(whole)


def test_a_failing_cell_is_a_row_with_its_reason(store):
    good = quick(1)[0]
    bad = [
        Cell("head_on", "nash", {"horizon": 3}, episodes=10),  # out of reach
        Cell("head_on", "nash", order=(0, 1, 2), episodes=10),  # three of two agents
        Cell("head_on", "social", solver="NONESUCH", episodes=10),
    ]
    rows = sweep([*bad, good], store)
    assert [row.failed for row in rows] == [True, True, True, False]
    assert [row.status for row in rows[:3]] == ["unreachable", "failed", "failed"]
    for row, advice in zip(rows, ["set the horizon to 9", "permutation", "NONESUCH"], strict=False):
        assert advice in row.reason
        assert row.crash_probability is None
    assert sweep([*bad, good], store) == rows  # failures are results too ...
    counts = []
    sweep([*bad, good], store, retry=True, progress=counts.append)  # ... unless requested
    assert counts == [1, 1, 1, 1]


def test_nothing_runs_if_a_cell_describes_no_game(store):
    with pytest.raises(InputError, match="nowhere"):
        sweep([*quick(1), Cell("nowhere", "nash")], store)
    with Store(store) as base:
        assert base.rows() == []


def test_a_worker_to_which_a_file_says_something_else_refuses(tmp_path):
    path = tmp_path / "game.toml"
    path.write_text(game_to_toml(make_game("parallel")))
    cell = Cell(str(path), "straight", episodes=10)
    address = cell.address
    path.write_text(game_to_toml(make_game("opposing")))
    report = play((pickle.loads(pickle.dumps(cell)), address))
    assert report["status"] == "failed"
    assert "do not edit files" in report["reason"]
    assert play((cell, address))["status"] == "feasible"


def test_a_full_disk_ends_the_sweep_and_the_next_goes_on(store, monkeypatch):
    cells, opened = quick(40), []
    whole = Store._open

    def cramped(base: Store) -> None:
        whole(base)
        base._base.execute("PRAGMA max_page_count = 10")
        opened.append(base)

    monkeypatch.setattr(Store, "_open", cramped)
    with pytest.raises(InputError, match="free some space"):
        sweep(cells, store)
    monkeypatch.undo()
    with Store(store) as base:
        kept = base.rows()
    assert 0 < len(kept) < len(cells)
    counts: list[int] = []
    rows = sweep(cells, store, progress=counts.append)
    assert counts[0] == len(kept)
    assert len(rows) == len(cells)
    assert timeless(row for row in rows if row in kept) == timeless(kept)


@pytest.mark.slow
def test_rows_do_not_depend_on_jobs(store, tmp_path):
    cells = [
        Cell(name, player, {"speed": "l1"}, episodes=500)
        for name in ("head_on", "intersection3")
        for player in ("nash", "straight")
    ]
    assert timeless(sweep(cells, store)) == timeless(sweep(cells, tmp_path / "b.db", jobs=2))


def deadly(number: int) -> int:
    """As out of memory or a faulty back end: the process cannot report it."""
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


@pytest.mark.slow
def test_what_kills_its_process_is_named_and_the_rest_goes_on():
    found = dict(each_done(deadly, range(5), 2))
    died = found.pop(1)
    assert isinstance(died, Died)
    assert "SIGKILL" in died.reason
    assert found == {0: 0, 2: 4, 3: 9, 4: 16}


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["dask", "ray"])
def test_clusters_give_the_same_rows(backend, store, tmp_path):
    pytest.importorskip({"dask": "distributed", "ray": "ray"}[backend])
    cells = quick(2)
    assert timeless(sweep(cells, store)) == timeless(
        sweep(cells, tmp_path / "cluster.db", jobs=2, backend=backend)
    )


def test_unknown_backends_are_refused(store):
    with pytest.raises(InputError, match="loky or dask or ray"):
        sweep(quick(1), store, backend="slurm")


@pytest.mark.slow
def test_workers_killed_from_outside_cost_no_row(store, tmp_path):
    """As by the system when memory runs out: what they were at is run again."""
    psutil = pytest.importorskip("psutil")
    cells, killed = quick(12), []

    def kill(_count: int) -> None:
        for child in psutil.Process().children():
            if "popen_loky" in " ".join(child.cmdline()) and len(killed) < 2:
                child.kill()
                killed.append(child.pid)

    rows = sweep(cells, store, jobs=2, progress=kill)
    assert len(killed) == 2
    assert not any(row.failed for row in rows)
    assert timeless(rows) == timeless(sweep(cells, tmp_path / "undisturbed.db"))


def whoami(_item: int) -> int:
    return os.getpid()


ENDLESS = """
from benchmarks.sweeps.workers import each_done
from tests.benchmarks.sweeps.test_run import whoami
for _, pid in each_done(whoami, [0] * 10_000, 2):
    print(pid, flush=True)
"""


@pytest.mark.slow
def test_workers_go_with_their_sweep():
    """A killed sweep cannot stop them; they would wait for work for minutes."""
    psutil = pytest.importorskip("psutil")
    command = [sys.executable, "-c", ENDLESS]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as sweeper:
        worker = psutil.Process(int(sweeper.stdout.readline()))
        assert worker.is_running()
        sweeper.kill()
    gone, _ = psutil.wait_procs([worker], timeout=600)
    assert gone or worker.status() == psutil.STATUS_ZOMBIE
