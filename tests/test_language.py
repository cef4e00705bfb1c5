"""The check of words in ``make lint`` finds each word of the list, and common misspellings."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
ENTRIES = [line.split("->") for line in (ROOT / "docs" / "words.txt").read_text().splitlines()]


def reported(path: Path) -> set[str]:
    """Return the words that codespell reports in a file, with the settings of the project."""
    command = [sys.executable, "-m", "codespell_lib", "--toml", str(ROOT / "pyproject.toml")]
    done = subprocess.run([*command, str(path)], cwd=ROOT, capture_output=True, text=True)
    assert bool(done.stdout) == bool(done.returncode), done.stderr
    return {line.split(": ")[1].split(" ==>")[0] for line in done.stdout.splitlines()}


def test_the_word_list_is_sorted_and_each_word_has_a_replacement() -> None:
    words = [word for word, _ in ENTRIES]
    assert words == sorted(set(words))
    assert all(instead.strip(", ") for _, instead in ENTRIES)


def test_the_check_of_words_bites(tmp_path: Path) -> None:
    words = {word for word, _ in ENTRIES}
    page = tmp_path / "page.md"
    page.write_text("\n".join(words))
    assert reported(page) == words
    wrong = {"No" + "body", "reci" + "eves"}  # split, so that this file passes
    page.write_text(" ".join(wrong))
    assert reported(page) == wrong
    page.write_text("No agent receives it.")
    assert reported(page) == set()
