"""Verdicts come from the cases alone, and what they depend on is what separates the cases."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.reproduction.verdicts import DEPENDS, FAILS, HOLDS, OPEN, Case, verdict

OUTCOMES = st.dictionaries(
    st.tuples(st.sampled_from("abc"), st.sampled_from("xy")), st.booleans(), min_size=1
)


def cases(outcomes):
    return [Case({"letter": a, "axis": b}, holds, "") for (a, b), holds in outcomes.items()]


@given(OUTCOMES)
def test_all_agree_or_it_depends(outcomes):
    found = verdict(cases(outcomes))
    expected = {(True,): HOLDS, (False,): FAILS}.get(tuple(set(outcomes.values())), DEPENDS)
    assert found.word == expected
    assert (found.holding, found.total) == (sum(outcomes.values()), len(outcomes))


@given(OUTCOMES)
def test_shares_add_up_to_all_cases(outcomes):
    found = verdict(cases(outcomes))
    for shares in found.on.values():
        assert sum(held for held, _ in shares.values()) == found.holding
        assert sum(count for _, count in shares.values()) == found.total


def test_the_factor_that_separates_the_cases_is_named_first():
    grid = [(a, b) for a in "abc" for b in "xy"]
    by_axis = verdict(cases({(a, b): b == "x" for a, b in grid}))
    assert list(by_axis.on) == ["axis"]  # the letter explains nothing
    assert str(by_axis) == "depends on axis (x: 3/3, y: 0/3)"
    by_letter = verdict(cases({(a, b): a == "a" for a, b in grid}))
    assert next(iter(by_letter.on)) == "letter"


def test_a_case_may_lack_a_factor():
    mixed = [Case({"axis": "x"}, True, ""), Case({"axis": "y", "letter": "a"}, False, "")]
    found = verdict(mixed)
    assert next(iter(found.on)) == "axis"
    assert "letter" not in found.on


def test_no_cases_are_no_verdict():
    assert str(verdict([])) == OPEN
