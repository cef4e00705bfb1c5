"""Pictures of an episode as a GIF."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ppg_env.env.canvas import need_pillow
from ppg_env.errors import require
from ppg_env.support.atomic_write import write_atomically

if TYPE_CHECKING:
    from PIL.Image import Image

PALETTE = 128
"""Colours of a GIF; with fewer, the smoothed edges of many agents show steps."""


def write_gif(frames: Iterable[np.ndarray], path: str | Path, fps: float = 4.0) -> Path:
    """Write pictures (H, W, 3) uint8 of one size as a GIF that loops.

    Raises
    ------
    InputError
        If there are no pictures, they differ in size, or the file cannot be written.
    """
    need_pillow()

    pictures = [np.asarray(frame) for frame in frames]
    require(bool(pictures), "frames", "are missing", "give at least one picture")
    require(
        all(p.dtype == np.uint8 and p.ndim == 3 and p.shape[2] == 3 for p in pictures)
        and len({p.shape for p in pictures}) == 1,
        "frames",
        "are not pictures of one size",
        "give arrays (H, W, 3) of uint8, as render() returns them with 'rgb_array'",
    )
    require(0 < fps <= 50, "fps", f"is {fps!r}", "write a number up to 50, the most of a GIF")
    first, *others = _indexed(pictures)
    stream = BytesIO()
    first.save(
        stream,
        format="GIF",
        save_all=True,
        append_images=others,
        duration=round(1000 / fps),
        loop=0,
    )
    return write_atomically(path, stream.getvalue())


def _indexed(pictures: Sequence[np.ndarray]) -> list[Image]:
    """Reduce the pictures to one palette of the colours that cover most of any one picture.

    One palette avoids flicker.  Areas of one colour keep it exactly, even if they appear only
    briefly, and only smoothed edges change; Pillow's own methods would tint the areas.
    """
    from PIL import Image
    from scipy.spatial.distance import cdist

    counted = [np.unique(_codes(picture), return_counts=True) for picture in pictures]
    codes, counts = (np.concatenate(part) for part in zip(*counted, strict=True))
    ranked = codes[np.argsort(-counts, kind="stable")]
    first = np.sort(np.unique(ranked, return_index=True)[1])
    palette, present = _colours(ranked[first[:PALETTE]]), np.unique(codes)
    nearest = cdist(_colours(present), palette).argmin(axis=1).astype(np.uint8)
    images = []
    for picture in pictures:
        images.append(Image.fromarray(nearest[np.searchsorted(present, _codes(picture))]))
        images[-1].putpalette(palette.astype(np.uint8).tobytes())
    return images


def _codes(picture: np.ndarray) -> np.ndarray:
    """Return colours (H, W, 3) as integers (H, W)."""
    red, green, blue = np.moveaxis(picture.astype(np.int32), 2, 0)
    return red << 16 | green << 8 | blue


def _colours(codes: np.ndarray) -> np.ndarray:
    """Return colours (K, 3) from integers (K,)."""
    return np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1)
