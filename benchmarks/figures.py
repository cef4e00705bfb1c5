"""Create and write matplotlib figures: PNG files, and SVG for the report.

Needs the extra ``render`` (matplotlib).  Figures need no display and no global state.
"""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

from ppg_env.errors import InputError
from ppg_env.support.atomic_write import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def new_figure(width: float, height: float) -> Figure:
    """Create an empty figure of ``width`` by ``height`` inches.

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError(
            "picture", "needs matplotlib", "install path-planning-games[render], or use --json"
        ) from None
    return Figure(figsize=(width, height), layout="constrained")


def write_figure(figure: Figure, path: str) -> None:
    """Write ``figure`` as a PNG without a date, so that equal figures are equal files."""
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=150, metadata={"Software": None})
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
