"""Names: what no table, picture or page could show is refused; other text is made printable."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import InputError, make_game
from ppg_env.support.names import LONGEST_NAME, printable, require_name

STRANGE = {
    "": "is empty",
    "  ": "is empty",
    "x" * 65: "has 65 characters",
    "ro\x1b[31mbot": "character '\\\\x1b', not printable",
    "a\nb": "not printable",
    "a‮b": "character '\\\\u202e'",
    "\ud800": "character '\\\\ud800'",
}


@pytest.mark.parametrize("name", STRANGE)
def test_a_name_that_cannot_be_shown_is_refused(name):
    with pytest.raises(InputError, match=STRANGE[name]):
        require_name(name, "name")
    with pytest.raises(InputError, match="name"):
        make_game("head_on", name=name)


@pytest.mark.parametrize("name", ["robot [/2]", "$x^{$", "=cmd()", "<b>", "Ünï ☃", "x" * 64])
def test_marks_of_other_languages_are_text(name):
    assert make_game("head_on", name=name).name == name


@given(st.text() | st.text(st.characters(categories=["Cs", "Cc", "Cf"])))
def test_printable_text_can_be_written_and_shown(text):
    shown = printable(text)
    assert len(shown.encode()) >= len(text)
    assert all(c.isprintable() or c == "\n" for c in shown)
    if text.isprintable() and len(text) <= LONGEST_NAME:
        assert shown == text
