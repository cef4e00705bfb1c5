"""What is printed: intervals that hold their estimates, explanations, the version."""

from __future__ import annotations

import re
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import terminal
from benchmarks.commands.explain import TOPICS
from benchmarks.crash_risk.query import Chance
from benchmarks.terminal import interval, outward, probability
from ppg_env.support.statistics import Interval

FORMATS = [(".2e", ".1e"), ("+.1e", "+.1e"), (".3f", ".3f"), (".4g", ".4g")]
chances = st.floats(0, 1, allow_subnormal=False)
numbers = st.floats(-1e12, 1e12, allow_subnormal=False) | chances


def printed(text: str) -> list[Decimal]:
    return [Decimal(number) for number in re.findall(r"[-+]?[\d.]+(?:e[-+]\d+)?", text)]


@given(st.tuples(numbers, numbers, numbers).map(sorted), st.sampled_from(FORMATS))
def test_an_interval_holds_its_estimate_as_printed(values, formats):
    low, value, high = values
    least, middle, most = sorted(printed(interval(Interval(value, low, high), *formats)))
    shown = printed(interval(Interval(value, low, high), *formats))
    assert shown == [middle, least, most]


@given(numbers, st.sampled_from([spec for _, spec in FORMATS]))
def test_limits_are_rounded_outward_by_less_than_a_digit(value, spec):
    low, high = (Decimal(outward(value, spec, up)) for up in (False, True))
    exact = Decimal(repr(value))
    assert low <= exact <= high
    nearest = Decimal(f"{value:{spec}}")
    assert nearest in (low, high) or low < nearest < high


@given(st.tuples(chances, chances, chances).map(sorted))
def test_a_probability_and_a_chance_hold_theirs(values):
    low, value, high = values
    for text in (probability(Interval(value, low, high)), str(Chance(value, low, high))):
        shown = printed(text)
        if len(shown) == 3:
            assert shown[1] <= shown[0] <= shown[2]
        elif text.startswith("<="):
            assert float(shown[0]) >= high >= low >= float(shown[-1] if shown[1:] else 0)
        else:
            assert text.startswith("< ")
            assert float(shown[0]) >= high


def test_the_known_case_is_in_its_interval():
    assert interval(Interval(0.0159, 0.0155, 0.01586 + 4e-5)) == "1.59e-02 [1.5e-02, 1.6e-02]"
    assert interval(Interval(0.0155, 0.0154, 0.0155)) == "1.55e-02 [1.5e-02, 1.6e-02]"
    assert interval(Interval(2.0, float("nan"), float("nan")), ".4g", ".4g") == "2"
    assert outward(float("inf"), ".3f", up=True) == "inf"


@pytest.mark.parametrize("topic", TOPICS)
def test_topics_are_explained(ppg, topic):
    report = ppg("explain", topic, "--json").json
    assert report["topic"] == topic
    assert ("95 % intervals" in report["terms"]) == (topic != "game")
    assert "nash" in [player["name"] for player in report["players"]]
    table = ppg("explain", topic).out
    assert all(term in table for term in report["terms"])


def test_a_topic_that_does_not_exist_is_refused(ppg):
    assert (
        "write compare or risk or regret or feedback or game" in ppg("explain", "magic", code=2).err
    )


def test_the_version_is_printed(ppg):
    assert re.fullmatch(r"ppg \d+\.\d+\.\d+\n", ppg("--version").out)


def test_a_bar_shows_what_is_done_between_steps(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal, "LOG_SECONDS", 0.0)
    with terminal.bar("training", 10) as advance:
        advance("grid 1 of 2")
        advance("")
        advance(10)
    lines = [line.rpartition(" in ")[0] for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "ppg: training, grid 1 of 2: 0/10",
        "ppg: training: 0/10",
        "ppg: training: 10/10",
    ]
