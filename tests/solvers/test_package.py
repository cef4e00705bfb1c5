"""One door: every public name resolves, and opening it costs nothing."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest

import solvers

PLANNERS = (
    "best_response",
    "best_response_dynamics",
    "certify",
    "potential_equilibrium",
    "social_optimum",
)


def test_every_exported_name_resolves_and_can_be_called():
    assert set(PLANNERS) <= set(solvers.__all__)
    for name in solvers.__all__:
        assert callable(getattr(solvers, name)), name
        assert name in dir(solvers)


@pytest.mark.parametrize("name", PLANNERS)
def test_a_planner_is_documented_and_takes_a_solver_and_a_time_limit(name):
    planner = getattr(solvers, name)
    assert inspect.getdoc(planner)
    assert {"solver", "time_limit"} <= set(inspect.signature(planner).parameters)


def test_a_name_that_does_not_exist_is_an_attribute_error():
    with pytest.raises(AttributeError, match="worst_response"):
        _ = solvers.worst_response


def test_importing_the_package_loads_no_solver():
    code = "import sys, solvers; print(*{'cvxpy', 'highspy', 'matplotlib'} & set(sys.modules))"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout.split() == []
