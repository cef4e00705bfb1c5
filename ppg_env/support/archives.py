"""Files of arrays (.npz): opened within limits, and what is wrong with one in a sentence."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.support.read_file import MIB, read_bytes


@contextmanager
def opened_archive(path: str | Path, remedy: str, most: int) -> Iterator[Any]:
    """Open the .npz file ``path``; yields its arrays, read when they are asked for.

    No code of the file is run.

    Parameters
    ----------
    path : the file.
    remedy : what to do if it is damaged.
    most : largest size of all arrays together after unpacking, in bytes.

    Raises
    ------
    InputError
        If the file cannot be read, unpacks to more than ``most``, or the block fails on damaged
        content.
    """
    source = str(path)
    content = read_bytes(path, most)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(member.file_size for member in archive.infolist())
        require(
            size <= most,
            source,
            f"unpacks to {size / MIB:,.0f} MiB, more than {most / MIB:g}",
            remedy,
        )
        with np.load(io.BytesIO(content), allow_pickle=False, max_header_size=10_000) as arrays:
            yield arrays
    except InputError:
        raise
    except zipfile.BadZipFile:
        raise InputError(source, "cannot be read (no archive)", remedy) from None
    except Exception as error:  # damaged content raises errors of many kinds
        raise InputError(source, f"cannot be read ({type(error).__name__})", remedy) from None


def about_json(arrays: Any) -> Any:
    """Return the JSON that an archive's entry ``about`` holds."""
    return json.loads(str(arrays["about"]))
