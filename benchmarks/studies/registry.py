"""The studies by name."""

from __future__ import annotations

from importlib import import_module

from benchmarks.studies.study import Study
from ppg_env.errors import require

STUDIES = (
    "learned", "tightness", "price", "sensitivity", "surrogate", "liability", "atlas", "scaling",
    "feedback",
)  # fmt: skip
"""Folders of this package; the module ``study`` of each defines a ``STUDY``."""


def find_study(name: str) -> Study:
    """Return the study called ``name``.

    Raises
    ------
    InputError
        If there is no such study.
    """
    require(name in STUDIES, "study", f"is {name!r}", "write " + " or ".join(STUDIES))
    study: Study = import_module(f"benchmarks.studies.{name}.study").STUDY
    return study
