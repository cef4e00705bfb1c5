"""One version everywhere, archives with the right contents, and recipes that name what we need."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.drills.wheel import build_wheel
from tests.packaging.contents import ROOT, defects_of_wheel, version


def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.slow
def test_a_wheel_has_what_it_needs_and_nothing_else(tmp_path: Path) -> None:
    wheel = build_wheel(tmp_path)
    assert defects_of_wheel(wheel) == []


@pytest.mark.parametrize(
    ("file", "pattern"),
    [
        ("CITATION.cff", r"(?m)^version: (.*)$"),
        ("recipe/recipe.yaml", r'(?m)^  version: "(.*)"$'),
    ],
)
def test_every_file_names_the_same_version(file: str, pattern: str) -> None:
    assert re.findall(pattern, (ROOT / file).read_text(encoding="utf-8")) == [version()]


def test_the_command_reports_that_version(ppg) -> None:
    assert re.fullmatch(r"ppg \d+\.\d+\.\d+\S*", ppg("--version").out.strip())


def test_the_conda_recipe_needs_what_the_project_needs() -> None:
    recipe = (ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8")
    listed = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    needs = sorted(re.sub(r"\s+", "", line.strip("- ")) for line in listed.strip().splitlines())
    own = [re.sub(r"\s+", "", need) for need in project()["dependencies"]]
    assert needs == sorted([*own, f"python{project()['requires-python']}"])


def test_the_release_workflow_publishes_without_a_stored_secret() -> None:
    text = (ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    assert "id-token: write" in text
    assert "secrets." not in text
    assert "tests.packaging.clean_install" in text


def pinned(file: Path) -> dict[str, str]:
    """Return the versions that a file pins, by the name of the distribution as pip compares it."""
    lines = file.read_text(encoding="utf-8").splitlines()
    pins = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {re.sub(r"[-_.]+", "-", name).lower(): version for name, version in pins}


def test_constraints_pin_whatever_the_project_and_its_extras_need() -> None:
    own = project()
    needs = [
        *own["dependencies"],
        *(need for extra in own["optional-dependencies"].values() for need in extra),
    ]
    names = {re.sub(r"[-_.]+", "-", re.split(r"[<>=\[]", need)[0]).lower() for need in needs}
    assert names - set(pinned(ROOT / "constraints.txt")) == set()


@pytest.mark.parametrize("library", ["torchrl_mappo", "pufferlib_ppo"])
def test_an_extra_installs_the_versions_that_its_example_was_tried_with(library: str) -> None:
    ours, tried = (pinned(ROOT / file) for file in ("constraints.txt", f"examples/{library}.txt"))
    assert {name: ours.get(name) for name in tried} == tried
