"""The README and the docs do as they say: commands run, code runs, printed outputs are current."""

from __future__ import annotations

import re
import shlex
import shutil
from importlib.util import find_spec
from pathlib import Path

import pytest

from benchmarks.sweeps.grid import is_grid, read_grid
from ppg_env import make_game
from ppg_env.env import read_randomize
from ppg_env.formats.game_file import read_game
from tests.command import Ppg
from tests.marks import slow_if

ROOT = Path(__file__).parents[1]
GAMES = ROOT / "docs" / "games"
PLAYERS = ("nash", "potential", "social", "straight", "ppo-selfish", "ppo-social")
PAGES = [
    ROOT / "README.md",
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if "_build" not in p.parts),
]


EXAMPLE = r"^(?:<!-- needs: (\w+) -->\n)?```python\n(.*?)^```"
"""An example in Python, and the library that it needs, if that is none of the extra ``test``."""


def blocks(page: Path, language: str) -> list[str]:
    """Contents of the fenced blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.S | re.M)


SHORTER = {
    "reproduce": "--settings l1:3 --scenarios parallel --lams 0.5 --episodes 500 --jobs 1",
    "train": "--steps 8192 --seeds 1 --jobs 1",
    "study": "--scenarios parallel --speeds l1 --lams 0.5 --episodes 1000 --jobs 1",
    "regret": "--steps 2048 --episodes 500",
    "study feedback": "--scenarios intersection3 --speeds box --lams 0.5 --episodes 1000 --jobs 1",
    "study scaling": "--scenarios intersection --lams 0.5 --episodes 1000",
}
"""What is added to a command of which the page says that it takes minutes, and to every bound on
regret; last options count."""


def commands(page: Path) -> list[str]:
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    found = [line.split("  #") for line in lines if line.startswith("ppg ")]
    return [
        f"{command} {_shorter(command)}"
        if "minutes" in "".join(remark) or command.startswith("ppg regret")
        else command
        for command, *remark in found
    ]


def _shorter(command: str) -> str:
    _, verb, name, *_ = command.split()
    return SHORTER.get(f"{verb} {name}", SHORTER[verb])


def words(command: str) -> list[str]:
    """The words of a command after ``ppg``."""
    return shlex.split(command)[1:]


def takes_long(page: Path) -> bool:
    """Whether the commands of a page take more than a few seconds, even shortened."""
    return (
        page.name
        in ("README.md", "fly.md", "learning.md", "play.md", "recipes.md", "risk.md", "sweeps.md")
        or page.parent.name == "studies"
    )


@pytest.mark.usefixtures("short_trainings")
@pytest.mark.parametrize(
    "page",
    slow_if(takes_long, PAGES, lambda page: page.name == "play.md"),
    ids=lambda page: page.name,
)
def test_commands_run_in_the_order_of_the_page(
    page: Path, ppg: Ppg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(GAMES, tmp_path / GAMES.name)
    for name, text in re.findall(
        r"<!-- file: (\S+) -->\n```toml\n(.*?)```", page.read_text(), re.S
    ):
        Path(name).write_text(text)
    for command in commands(page):
        ppg(*words(command))


@pytest.mark.parametrize(
    "page",
    slow_if(lambda page: page.name in ("learning.md", "risk.md"), PAGES),
    ids=lambda page: page.name,
)
def test_code_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for library, block in re.findall(EXAMPLE, page.read_text(), re.S | re.M):
        if not library or find_spec(library):
            exec(compile(block, page.name, "exec"), {})


def test_the_readme_has_commands_and_code() -> None:
    assert len(commands(ROOT / "README.md")) >= 10
    assert len(blocks(ROOT / "README.md", "python")) >= 2


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_game_files_load(page: Path, tmp_path: Path) -> None:
    for block in blocks(page, "toml"):
        path = tmp_path / "game.toml"
        path.write_text(block)
        if block.startswith("[randomize]"):
            read_randomize(path)
        else:
            assert read_grid(path).cells() if is_grid(str(path)) else read_game(path).agents


COMPARISONS = [
    (command, shown)
    for page in PAGES
    for command, shown in re.findall(
        r"<!-- output of: (ppg compare .*?) -->\n```text\n(.*?)```", page.read_text(), re.S
    )
]
"""Commands and what the pages say that they print."""


@pytest.mark.parametrize(
    "printed",
    slow_if(
        lambda printed: "ppo" in printed[0],
        COMPARISONS,
        nightly=lambda printed: "feedback" in printed[0] or "pairwise" in printed[0],
    ),
    ids=lambda pair: pair[0],
)
def test_printed_comparisons_are_current(
    printed: tuple[str, str], ppg: Ppg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Arrivals, costs and crashes of the tables; not the last digits of a back end's regret."""
    command, shown = printed
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("benchmarks.comparison.pictures.comparison_picture", lambda *shown: None)
    old, new = numbers(shown), numbers(ppg(*words(command)).out)
    assert list(old) == list(new)
    for player, values in old.items():
        assert values == pytest.approx(new[player], rel=0.02), f"run docs/outputs.py: {player}"


def test_the_readme_compares_planners_and_learned_players() -> None:
    assert len(COMPARISONS) >= 2
    assert sum("ppo" in command for command, _ in COMPARISONS) == 3


REGRET = "regret <="
"""Title of the column of regrets: those of equilibria are the noise of a back end."""


def numbers(table: str) -> dict[str, list[float]]:
    """What each row of a comparison says, the regret left out; mirror images count as one.

    Several solutions may cost the same, mirror images above all, and which one a back end finds
    may change with its version: numbers in one cell, such as arrivals, are added up.  Learned
    players compute in single precision, whose last digits differ between processors.
    """
    players = {}
    regret = range(0)
    for line in table.splitlines():
        if REGRET in line:
            regret = range(start := line.index(REGRET), start + len(REGRET))
        (name, _), *cells = [*cells_of(line), ("", range(0))]
        if name in PLAYERS:
            kept = [text for text, place in cells if not set(place) & set(regret)]
            values = [re.findall(r"[-+]?\d[\d.]*(?:e[-+]\d+)?", text) for text in kept]
            players[name] = [sum(map(float, cell)) for cell in values if cell]
    assert players
    return players


def cells_of(line: str) -> list[tuple[str, range]]:
    """The cells of a line of a table, and the columns of characters that each takes."""
    return [(cell[0], range(*cell.span())) for cell in re.finditer(r"\S+(?: \S+)*", line)]


@pytest.mark.parametrize(
    "page", slow_if(lambda page: page.name == "sweeps.md", PAGES), ids=lambda page: page.name
)
def test_printed_sweeps_are_current(
    page: Path, ppg: Ppg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Words, arrivals and costs; not crash probabilities, which differ between mirror images."""
    monkeypatch.chdir(tmp_path)
    pattern = r"<!-- output of: (ppg sweep .*?) -->\n```text\n(.*?)```"
    for command, shown in re.findall(pattern, page.read_text(), re.S):
        old, new = sweep_lines(shown), sweep_lines(ppg(*words(command)).out)
        assert len(old) == len(new)
        for before, after in zip(old, new, strict=True):
            assert before[0] == after[0], "run docs/outputs.py"
            assert before[1] == pytest.approx(after[1], rel=0.02), "run docs/outputs.py"


def sweep_lines(table: str) -> list[tuple[list[str], list[float]]]:
    """Words and numbers of each line of a sweep's table; numbers in one cell are added up."""
    found = []
    bare = "\n".join(line.strip() for line in table.strip().splitlines())
    for line in bare.split("\n\n")[1].splitlines():
        cells = [cell for cell in re.split(r"\s{2,}", line) if not re.search(r"[\[<]", cell)]
        words = [cell for cell in cells if not re.fullmatch(r"[\d. -]+", cell)]
        sums = [sum(map(float, re.findall(r"[\d.]+", cell))) for cell in cells if cell not in words]
        found.append((words, sums))
    return found


@pytest.mark.parametrize(
    "page",
    slow_if(lambda page: page.name in ("learning.md", "risk.md"), PAGES),
    ids=lambda page: page.name,
)
def test_printed_studies_are_what_their_results_say(
    page: Path, ppg: Ppg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the stored rows, which are next to the page; nothing is run again."""
    monkeypatch.chdir(tmp_path)
    pattern = r"<!-- output of: (ppg study .*?) -->\n```text\n(.*?)```"
    for command, shown in re.findall(pattern, page.read_text(), re.S):
        (name,) = re.findall(r"--results (\S+)", command)
        stored = (page.parent / name).read_bytes()
        Path(name).write_bytes(stored)
        lines = [line.rstrip() for line in ppg(*words(command)).out.splitlines()]
        assert "\n".join(lines).strip("\n") == shown.strip("\n")
        assert Path(name).read_bytes() == stored


def test_the_check_of_printed_comparisons_bites() -> None:
    table = """
 player     sees        arrival  social cost  regret <=            crash probability  expected cost
 nash       own state  12.19 9.14    18.9688      2e-09  9.00e-02 [8.7e-02, 9.2e-02]   9.93 ± 0.04
 social     own state      9 14      18.5195             9.10e-04 [7.8e-04, 1.1e-03]   9.22 ± 0.01
"""
    assert numbers(table) == {
        "nash": pytest.approx([21.33, 18.9688, 0.269, 9.97]),
        "social": pytest.approx([23, 18.5195, 0.00279, 9.23]),
    }
    assert numbers(table) == numbers(table.replace("2e-09", "3e-08"))
    assert numbers(table) != numbers(table.replace("18.9688", "17.9688"))


def test_the_check_of_printed_sweeps_bites() -> None:
    line = " head_on   nash    0.8  equilibrium   13 9   18.9688  1.6e-02 [1.5e-02, 1.8e-02]  9.127"
    assert sweep_lines(f"1 rows\n\n{line}\n\nNote") == [
        (["head_on", "nash", "equilibrium"], [0.8, 22.0, 18.9688, 9.127])
    ]


def test_the_examples_of_the_readme_name_real_scenarios() -> None:
    for command in commands(ROOT / "README.md"):
        verb, *rest = words(command)
        if verb in ("show", "solve", "compare", "train", "regret") and ".toml" not in rest[0]:
            make_game(rest[0])
