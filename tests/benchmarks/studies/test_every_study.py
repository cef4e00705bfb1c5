"""What all studies share: the command, the stored results of the docs, their Markdown."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.text import Text

from benchmarks.studies.markdown import markdown_table, study_markdown
from benchmarks.studies.registry import STUDIES, find_study
from benchmarks.studies.results import read_rows
from benchmarks.sweeps import Store
from ppg_env import InputError
from tests.benchmarks.judges import picture_size
from tests.benchmarks.studies.conftest import SMALL

DOCS = Path(__file__).parents[3] / "docs"
SWEPT = [name for name in STUDIES if find_study(name).digest]
FEW = [
    "--scenarios", SMALL.scenarios[0], "--speeds", SMALL.speeds[0], "--lams", SMALL.lams[0],
    "--episodes", SMALL.episodes,
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", SWEPT)
def test_a_study_is_stored_reported_and_drawn(ppg, tmp_path, monkeypatch, store, whole, name):
    study = find_study(name)
    whole(study)
    monkeypatch.chdir(tmp_path)
    words = ["study", name, *FEW, "--results", "rows.json"]
    done = ppg(*words, "--store", store, "--out", "picture.png")
    pictures = sorted(tmp_path.glob("picture*.png"))
    assert len(pictures) == len(study.draw(read_rows(tmp_path / "rows.json", name)))
    for picture in pictures:
        picture_size(picture)
    again = ppg(*words, "--store", "none.db", "--json").json
    assert not (tmp_path / "none.db").exists()
    assert again["rows"] == read_rows(tmp_path / "rows.json", name)
    assert [row["address"] for row in again["rows"]] == [c.address for c in study.cells(SMALL)]
    printed = " ".join(done.out.split())
    assert all(" ".join(sentence.split()) in printed for sentence in again["words"])
    for table in study.tables(again["rows"]):
        assert table.title in done.out
    text = study_markdown(name, tmp_path / "rows.json", "words")
    assert text == "\n".join(f"- {sentence}" for sentence in again["words"])


@pytest.mark.slow
def test_a_study_of_games_whose_bodies_keep_apart_between_steps(store, whole, tmp_path):
    study = find_study("price")
    usual = study.rows(SMALL, tmp_path / "rows.json", store)
    swept = study.rows(replace(SMALL, collisions="swept"), tmp_path / "swept.json", store)
    assert len(usual) == len(swept)
    assert not {row["address"] for row in usual} & {row["address"] for row in swept}
    assert all("reason" not in row for row in swept)
    with Store(store) as base:
        assert {base.get(row["address"]).collisions for row in swept} == {"swept"}


@pytest.mark.slow
@pytest.mark.parametrize("name", SWEPT)
@pytest.mark.parametrize(
    ("rule", "event"), [("instants", "at the time steps"), ("swept", "during the steps")]
)
def test_every_figure_and_some_table_say_what_a_crash_is(name, rule, event):
    study = find_study(name)
    rows = [
        row | {"collisions": rule} for row in read_rows(DOCS / "studies" / f"{name}.json", name)
    ]
    for figure in study.draw(rows).values():
        assert any(f"overlap {event}" in text.get_text() for text in figure.findobj(Text))
    assert any(f"overlap {event}" in table.note for table in study.tables(rows))


@pytest.mark.parametrize("name", [name for name in STUDIES if name not in SWEPT])
def test_a_study_with_cells_of_its_own_has_the_rule_of_the_paper(ppg, name, tmp_path):
    words = ["study", name, *FEW, "--results", tmp_path / "rows.json", "--collisions", "swept"]
    assert "the paper's rule" in ppg(*words, code=2).err
    assert not (tmp_path / "rows.json").exists()


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_without_rows_says_little_and_fails_nowhere(name):
    study = find_study(name)
    assert study.name == name
    assert study.question.endswith("?")
    if study.digest:
        assert all(not table.lines for table in study.tables([]))
        assert "nan" not in " ".join(study.words([]))


@pytest.mark.parametrize("name", SWEPT)
def test_the_results_in_the_docs_are_those_of_the_whole_study(name):
    """Addresses hold everything that determines a row: old results would have other ones."""
    study = find_study(name)
    rows = read_rows(DOCS / "studies" / f"{name}.json", name)
    wanted = dict.fromkeys(cell.address for cell in study.cells(study.choice))
    assert [row["address"] for row in rows] == list(wanted), f"run the command of {name}.md"


@pytest.mark.parametrize("name", SWEPT)
def test_every_page_shows_its_results(name):
    page = (DOCS / "studies" / f"{name}.md").read_text()
    for part in ("question", "words", "tables"):
        assert f"```{{study}} {name} {part}" in page
        assert study_markdown(name, DOCS / "studies" / f"{name}.json", part)
    assert re.findall(rf"ppg study {name} .*--results {name}.json", page)
    for picture in re.findall(r"!\[.+?\]\((.+?\.png)\)", page):
        picture_size(DOCS / "studies" / picture)


def test_markdown_has_a_rule_and_escapes_bars():
    assert markdown_table(("a", "b\nc"), [("x|y", "1")], texts=1).splitlines() == [
        "| a | b c |",
        "| --- | ---: |",
        "| x\\|y | 1 |",
    ]


def test_a_missing_file_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        study_markdown("price", tmp_path / "none.json", "words")
    with pytest.raises(InputError, match="question or words or tables"):
        study_markdown("price", DOCS / "studies" / "price.json", "verse")
    with pytest.raises(InputError, match="learned or tightness"):
        find_study("magic")
