"""Configuration of Sphinx."""

from __future__ import annotations

import re
import sys
from importlib.metadata import version as version_of
from importlib.util import find_spec
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))  # for the extension `tables` next to this file

project = "Path planning games"
author = "The path planning games contributors"
release = version = version_of("path-planning-games")

extensions = [
    "myst_nb",
    "sphinx_gallery.gen_gallery",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "tables",
]
exclude_patterns = ["_build", "gallery", "pictures/*.ipynb"]
smartquotes = False  # they would turn --json into a dash

myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 4

# A copy of MathJax that comes as a package: formulas are drawn without a network.
copies = find_spec("sphinx-mathjax-offline")
assert copies is not None
assert copies.submodule_search_locations is not None
html_static_path = [str(Path(copies.submodule_search_locations[0], "static/mathjax/tex-svg.js"))]
mathjax_path = "tex-svg.js"
html_extra_path = ["editor.html"]

# Notebooks are text (MyST, as Jupytext reads it).  An error in a cell is a warning, which fails.
nb_execution_mode = "force"
nb_execution_timeout = 120
nb_merge_streams = True
nb_output_stderr = "remove"  # that the simulator is compiled, at the first build

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "pictures",
    "abort_on_example_error": True,
    "within_subsection_order": "FileNameSortKey",
    "min_reported_time": 1000,  # seconds: times of one machine are not shown
    "write_computation_times": False,
    "show_signature": False,
}

# The extra `docs` has no learners: their modules are read without them, and so the pages are the
# same whether or not they are installed.
autodoc_mock_imports = ["pufferlib", "stable_baselines3", "tensordict", "torch", "torchrl"]

autodoc_member_order = "groupwise"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_ivar = True  # attributes are documented once, in the class docstring
napoleon_use_rtype = False

html_theme = "furo"
html_title = project
html_show_copyright = False


def read_house_style(
    app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Turn what the docstrings of this project leave implicit into what Sphinx understands.

    Indented formulas become literal blocks, and ``name : text`` in a list of attributes gets its
    text below the name, where it does not count as a type.
    """
    if lines:  # a set: its bars are no substitutions
        lines[0] = re.sub(r"(?<!`){.*?}(?!`)", r"``\g<0>``", lines[0])
    for k in range(len(lines) - 1, 1, -1):
        opens = lines[k].startswith("    ") and not lines[k - 1].strip()
        before = lines[k - 2]
        if opens and before.strip() and not before.startswith((" ", "..")):
            lines[k:k] = ["::", ""]
    start = lines.index("Attributes") if "Attributes" in lines else len(lines)
    for k in range(len(lines) - 1, start, -1):
        if entry := re.match(r"([\w, ]+?) : (.*)", lines[k]):
            names = entry[1].replace(", ", ",")  # Sphinx takes a word before a blank for a type
            lines[k : k + 1] = [names, f"    {entry[2]}"]


def setup(app: Any) -> None:
    """Connect the hooks of this file."""
    app.connect("autodoc-process-docstring", read_house_style, priority=400)  # before napoleon
