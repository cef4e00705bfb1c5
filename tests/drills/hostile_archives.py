"""Hostile files of arrays, and checkpoints: pickles, bombs, and names that leave the folder."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from tests.drills.hostile_files import Case, Words

COMPARE = ("compare", "intersection", "--speed", "l1", "--episodes", "100", "--players")
ABOUT: dict[str, Any] = {
    "player": "x",
    "game": {},
    "lam": None,
    "version": 1,
    "runs": [[{"layers": 1}]],
}


class Bomb:
    """Makes a folder when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.mark),)


def _compare(folder: Path, content: bytes) -> Words:
    (folder / "players.npz").write_bytes(content)
    return *COMPARE, "players.npz"


def _pickle(folder: Path) -> Words:
    return _compare(folder, pickle.dumps(Bomb(folder / "executed")))


def _object_array(folder: Path) -> Words:
    stream, bomb = io.BytesIO(), np.empty(1, dtype=object)
    bomb[0] = Bomb(folder / "executed")
    np.savez(stream, about=bomb)
    return _compare(folder, stream.getvalue())


def _array(shape: str) -> bytes:
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': %s, }" % shape.encode()
    return b"\x93NUMPY\x01\x00\x76\x00" + header.ljust(117) + b"\n"


def _archive(format_name: str, member: str, content: bytes, repeats: int = 1) -> Case:
    def make(folder: Path) -> Words:
        stream, about = io.BytesIO(), io.BytesIO()
        np.save(about, np.array(json.dumps(ABOUT | {"format": format_name})))
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            archive.writestr("about.npy", about.getvalue())
            with archive.open(member, "w", force_zip64=True) as inner:
                for _ in range(repeats):
                    inner.write(content)
        return _compare(folder, stream.getvalue())

    return make


def _checkpoint(folder: Path) -> Words:
    place = folder / "players.npz.checkpoints"
    place.mkdir()
    (place / "seed-0.pt").write_bytes(pickle.dumps(Bomb(folder / "executed")))
    return "train", "intersection", "--speed", "l1", "--steps", 4096, "--out", "players.npz"


LEARNED, FEEDBACK = "path-planning-games/learned", "path-planning-games/feedback"
WEIGHT = "run0_agent0_weight0.npy"
ARCHIVES: dict[str, Case] = {
    "players that are a pickle": _pickle,
    "players with an array of objects": _object_array,
    "players that unpack to 7 GiB": _archive(LEARNED, WEIGHT, bytes(64 << 20), 112),
    "feedback policies that unpack to 7 GiB": _archive(FEEDBACK, WEIGHT, bytes(64 << 20), 112),
    "players with an array that claims 10^12 numbers": _archive(
        LEARNED, WEIGHT, _array("(10**12,)")
    ),
    "players with an array of 10^12 numbers": _archive(LEARNED, WEIGHT, _array("(1000000000000,)")),
    "players with an array of negative size": _archive(LEARNED, WEIGHT, _array("(-1, 8)")),
    "players with a file outside their folder": _archive(LEARNED, "../../outside", b"x"),
    "a checkpoint that is a pickle": _checkpoint,
}
