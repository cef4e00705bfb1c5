"""Random exploration: the property tests over new examples until the time is up.

``python -m tests.fuzz SECONDS`` runs rounds of all tests with ``@given``.  It stops after the first
round with a failure, prints each failing example in the form in which a test takes it, and exits
with 1; it exits with 0 if no round failed.
"""

from __future__ import annotations

import re
import sys
import time
from dataclasses import dataclass, field
from random import randrange

import pytest

ARGUMENTS = ["-m", "hypothesis", "--hypothesis-profile=fuzz", "-q"]


@dataclass(eq=False)  # pytest hashes its plugins
class Exploration:
    """A pytest plugin that ends a round when the time is up and collects what failed."""

    deadline: float
    failures: dict[str, str] = field(default_factory=dict)
    """Report of each failed test, by its address."""

    @property
    def over(self) -> bool:
        """Whether the time is up or a test has failed."""
        return bool(self.failures) or time.monotonic() >= self.deadline

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the report of a failed test."""
        if report.failed:
            self.failures[report.nodeid] = report.longreprtext

    def pytest_runtest_logfinish(self) -> None:
        """Run no further test when the time is up."""
        if time.monotonic() >= self.deadline:
            pytest.exit("the time is up", returncode=0)


def ready_test(address: str, report: str) -> str:
    """Return what to write above the ``@given`` of a failed test so that it fails again."""
    text = re.sub(r"(?m)^E? {0,7}(?:\| )?", "", report)
    lines = [f"# {address}"]
    calls = r"(?s)(?:Falsifying example|Failing test case): \w+(\(.*?\n\))"
    lines += [f"@example{call}" for call in re.findall(calls, text)]
    lines += re.findall(r"@reproduce_failure\(.*?\)(?= as a decorator)", text)
    return "\n".join(lines)


def main(seconds: float) -> int:
    """Explore for this many seconds; return the exit code."""
    exploration = Exploration(time.monotonic() + seconds)
    rounds = 0
    while not exploration.over:
        rounds += 1
        # In another order each time, so that every test has its turn in a short box.
        code = pytest.main([*ARGUMENTS, f"--shuffle={randrange(2**32)}"], [exploration])
        if code and not exploration.failures:
            return int(code)
    if not exploration.failures:
        print(f"no failing example in {seconds:g} s ({rounds} rounds, the last one cut short)")
        return 0
    print("\nFailing examples; write one of the lines above the test's @given:\n")
    print("\n\n".join(ready_test(*failure) for failure in exploration.failures.items()))
    return 1


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 300))
