"""The drill ``mutation``: do the tests notice small changes of the code that all else rests on?

Each mutant is judged in a process of its own, forked from one that has imported the libraries but
none of our packages.  Kernels run as plain Python (``NUMBA_DISABLE_JIT=1``).
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import json
import multiprocessing
import os
import resource
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import ModuleType

from tests.drills.figures import ROOT, Figure, wanted
from tests.drills.mutants import Mutant, count_mutants, make_mutant

SECONDS = 100
"""CPU seconds for the tests of one mutant; one that takes more counts as killed."""

WAITED = 1000.0
"""The same for a mutant that waits; long, since the machine may be busy with other things."""

EXPLAINED = Path(__file__).with_name("equivalent.json")
SURVIVORS = Path(__file__).with_name("survivors.txt")


@dataclass(frozen=True)
class Target:
    """A module, the functions that are mutated (all if none is named), and its tests.

    ``quick`` are tests among them that run first, because they end most mutants soon.
    """

    module: str
    tests: tuple[str, ...]
    functions: tuple[str, ...] = ()
    share: float = 1.0
    quick: tuple[str, ...] = ()


RULES = "tests/ppg_env/env/test_rules.py"
FIRST = ("a_parked_body_can_be_hit", "agents_that_share_wait_for_the_last",
         "on_schedule_agents_leave_at_their_time_wherever_they_are",
         "inputs_are_projected_on_the_control_set", "bodies_that_only_touch_do_not_crash",
         "a_time_limit_truncates_and_does_not_terminate",
         "the_kernel_plays_by_the_rules[tired-risk-clip]")  # fmt: skip
BLOCKS = (
    "tests/ppg_env/env/test_changing_controls.py"
    "::test_every_block_of_copies_moves_by_the_set_of_its_own_time"
)
QUICK = tuple(f"{RULES}::test_{name}" for name in FIRST)

TARGETS = {
    "evaluator": Target(
        "ppg_env.game.evaluation",
        ("tests/ppg_env/game/test_evaluation_in_motion.py",
         "tests/benchmarks/library/test_checker.py", "tests/ppg_env/game/test_evaluation.py"),
    ),
    "checker": Target("benchmarks.library.checker", ("tests/benchmarks/library/test_checker.py",)),
    "certificate": Target(
        "solvers.equilibrium.certificate", ("tests/solvers/equilibrium/test_certificate.py",)
    ),
    "proofs of certificates": Target(
        "solvers.equilibrium.regret_proofs",
        ("tests/solvers/equilibrium/test_certificate.py", "tests/solvers/test_injected_faults.py"),
    ),
    "claims of solvers": Target(
        "solvers.search_result", ("tests/solvers/test_injected_faults.py",), share=0.5
    ),
    "kernel": Target("ppg_env.env.kernel", (RULES,), share=0.25, quick=(*QUICK, BLOCKS)),
    "movement": Target("ppg_env.env.movement", (RULES,), share=0.25, quick=QUICK),
    "life cycle": Target("ppg_env.env.life_cycle", (RULES,), share=0.25, quick=QUICK),
    "encounters": Target("ppg_env.env.encounters", (RULES,), share=0.25, quick=QUICK),
}  # fmt: skip


def drill(size: float) -> Iterator[Figure]:
    """Judge the mutants of every module, a share of them if ``size`` is below 1."""
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        words = [sys.executable, "-c", f"from tests.drills.mutation import report; report({size})"]
        plain = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"}
        with subprocess.Popen(
            words, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=plain
        ) as judge:
            assert judge.stdout is not None
            for line in judge.stdout:
                if line.startswith("{"):
                    fields = json.loads(line)
                    yield Figure(**fields | {"failures": tuple(fields["failures"])})
        return
    yield from _judged(size)


def report(size: float) -> None:
    """Print the figures as lines of JSON."""
    for figure in _judged(size):
        sys.stdout.write(json.dumps(vars(figure)) + "\n")
        sys.stdout.flush()


def _judged(size: float) -> Iterator[Figure]:
    import cvxpy  # noqa: F401  # what the children would import again and again
    import hypothesis  # noqa: F401
    import numba  # noqa: F401
    import pettingzoo  # noqa: F401
    import pytest  # noqa: F401
    import scipy.optimize
    import scipy.spatial
    import scipy.stats  # noqa: F401

    explained = json.loads(EXPLAINED.read_text("utf-8")) if EXPLAINED.exists() else {}
    for name, target in TARGETS.items():
        if not wanted(name):
            continue
        source = (ROOT / f"{target.module.replace('.', '/')}.py").read_text("utf-8")
        only = frozenset(target.functions)
        every = range(count_mutants(source, only))
        count = max(1, round(len(every) * min(size * target.share, 1.0)))
        chosen = [make_mutant(source, k, only) for k in Random(name).sample(every, count)]
        if _ends(target, None) != "survived":
            failure = "the tests fail without any change"
            yield Figure(_what(name, target), "0 mutants", "", (failure,))
            continue
        survivors = [mutant for mutant in chosen if _ends(target, mutant) == "survived"]
        yield _figure(name, target, source, every, chosen, survivors, explained)


def _what(name: str, target: Target) -> str:
    return f"{name} (`{target.module}`)"


def _figure(
    name: str,
    target: Target,
    source: str,
    every: Sequence[int],
    chosen: Sequence[Mutant],
    survivors: Sequence[Mutant],
    explained: dict[str, dict[str, str]],
) -> Figure:
    lines, known, unknown = source.splitlines(), 0, []
    for mutant in survivors:
        key = f"{lines[mutant.line - 1].strip()} :: {mutant.change}"
        if key in explained.get(target.module, {}):
            known += 1
        else:
            unknown.append(f"line {mutant.line}, {mutant.change}")
            with SURVIVORS.open("a", encoding="utf-8") as file:
                file.write(f"{target.module}\t{key}\n")
    killed = len(chosen) - len(survivors)
    return Figure(
        _what(name, target),
        f"{len(chosen)} of {len(every)} mutants",
        f"{killed} killed, {known} equivalent, {len(unknown)} survived",
        tuple(unknown),
    )


def _ends(target: Target, mutant: Mutant | None) -> str:
    """Return ``survived`` if all tests pass, or ``killed``."""
    process = multiprocessing.get_context("fork").Process(target=_test, args=(target, mutant))
    process.start()
    process.join(WAITED)
    if process.is_alive():
        process.kill()
        process.join()
        return "killed"
    return "survived" if process.exitcode == 0 else "killed"


def _test(target: Target, mutant: Mutant | None) -> None:
    import pytest

    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    null = os.open(os.devnull, os.O_WRONLY)
    if mutant is not None:
        sys.meta_path.insert(0, _Finder(target.module, mutant.source))
        os.dup2(null, 2)
    os.dup2(null if mutant is not None else 2, 1)
    os.chdir(ROOT)
    options = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not slow"]
    options += ["--hypothesis-profile", "mutants"]
    # Of integers that wrap around, where kernels are Python; and of what this process has imported.
    for warning in ("RuntimeWarning", "pytest.PytestAssertRewriteWarning"):
        options += ["-W", f"ignore::{warning}"]
    for tests in (target.quick, target.tests):
        code = int(pytest.main([*options, *tests])) if tests else 0
        if code:
            break
    os._exit(code)


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Loads one module from a changed source."""

    def __init__(self, name: str, source: str) -> None:
        self.name, self.source = name, source

    def find_spec(
        self, name: str, path: object = None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        if name != self.name:
            return None
        location = ROOT / f"{name.replace('.', '/')}.py"
        return importlib.util.spec_from_file_location(name, location, loader=_Source(self))

    def exec_module(self, module: ModuleType) -> None:
        """Run the changed source in ``module``."""
        file = str(module.__file__)
        exec(compile(self.source, file, "exec"), module.__dict__)


class _Source(importlib.abc.Loader):
    def __init__(self, finder: _Finder) -> None:
        self.finder = finder

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        self.finder.exec_module(module)
