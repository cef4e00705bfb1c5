"""Create and write matplotlib figures: PNG, SVG and PDF files, and SVG for the report.

Needs the extra ``render`` (matplotlib).  Figures need no display and no global state.
"""

from __future__ import annotations

from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from benchmarks.output_paths import target
from ppg_env.errors import require
from ppg_env.support.atomic_write import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INSTALL = "install path-planning-games[render]"

PICTURES = (".png", ".svg", ".pdf")
"""Endings of pictures."""


def has_matplotlib() -> bool:
    """Return whether pictures can be drawn."""
    return find_spec("matplotlib") is not None


def picture_target(name: str, given: str | None, *, as_json: bool) -> str | None:
    """Return where a command draws, checked before its work is done; None for no picture.

    A command that was asked for JSON draws only if a path is ``given``; without matplotlib, too.

    Raises
    ------
    InputError
        If nothing can be drawn at the path ``given``.
    """
    if given is None and as_json:
        return None
    if given is None and not has_matplotlib():
        typer.echo(f"ppg: no picture without matplotlib; {INSTALL}.", err=True)
        return None
    require(has_matplotlib(), given or "", "needs matplotlib", INSTALL)
    return target(name, given, *PICTURES)


def new_figure(width: float, height: float) -> Figure:
    """Create an empty figure of ``width`` by ``height`` inches.

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    require(has_matplotlib(), "picture", "needs matplotlib", f"{INSTALL}, or use --json")
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def write_figure(figure: Figure, path: str) -> None:
    """Write ``figure`` as its ending says, without a date, so that equal figures are equal files.

    Parameters
    ----------
    figure : the figure.
    path : a file that ends in one of :data:`PICTURES`.
    """
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind == "svg":
        write_atomically(path, svg(figure))
        return
    stream = BytesIO()
    metadata = {"Software": None} if kind == "png" else {"CreationDate": None}
    figure.savefig(stream, format=kind, dpi=150, metadata=metadata)
    write_atomically(path, stream.getvalue())


def svg(figure: Figure) -> bytes:
    """Return ``figure`` as SVG; equal figures give equal bytes."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    stream = BytesIO()
    with rc_context({"svg.hashsalt": "path-planning-games"}):
        # Figure.savefig would draw a second time.
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None})
    return stream.getvalue()
