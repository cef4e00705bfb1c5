"""The page of the drills says what is stored, and the mutants of a module are what they claim."""

from __future__ import annotations

import ast
from difflib import unified_diff

from tests.drills.__main__ import DRILLS
from tests.drills.figures import load
from tests.drills.mutants import count_mutants, make_mutant
from tests.drills.page import ABOUT, PAGE, page

SOURCE = '''
def f(a: float | None, b: int) -> float:
    """Text."""
    c = a + b
    if not a < 1:
        c = -min(a, c)
    return c
'''


def test_the_page_is_written_from_the_stored_figures() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(load())
    assert set(load()) <= set(ABOUT) == set(DRILLS)


def test_each_mutant_differs_from_the_module_in_one_place() -> None:
    plain = ast.unparse(ast.parse(SOURCE)).splitlines()
    every = [make_mutant(SOURCE, k) for k in range(count_mutants(SOURCE))]
    assert {mutant.change for mutant in every} == {
        "Add to Sub", "dropped: c = a + b", "Not dropped", "Lt to LtE", "1 to 2",
        "dropped: c = -min(a, c)", "USub dropped", "min to max",
    }  # fmt: skip
    for mutant in every:
        changed = list(unified_diff(plain, mutant.source.splitlines(), n=0))
        assert sum(line.startswith("+ ") for line in changed) == 1


def test_annotations_are_left_alone() -> None:
    heads = {make_mutant(SOURCE, k).source.splitlines()[0] for k in range(count_mutants(SOURCE))}
    assert heads == {"def f(a: float | None, b: int) -> float:"}
