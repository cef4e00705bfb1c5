"""Read a file that a user names: a regular file, of bounded size, or one sentence."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ppg_env.errors import InputError, require

MIB = 1 << 20


def read_bytes(path: str | Path, most: int = 64 * MIB) -> bytes:
    """Return the content of ``path``.

    Parameters
    ----------
    path : a regular file; a pipe or device could block or never end.
    most : largest size, in bytes.

    Raises
    ------
    InputError
        If there is no such file, it is not a regular file, is larger, or cannot be read.
    """
    source = str(path)
    try:
        # A pipe without a writer would block on opening.
        handle = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
        with os.fdopen(handle, "rb") as stream:
            state = os.fstat(handle)
            require(
                stat.S_ISREG(state.st_mode), source, "is not a regular file", "name a plain file"
            )
            require(
                state.st_size <= most,
                source,
                f"has {state.st_size / MIB:,.0f} MiB",
                f"give a file of at most {most / MIB:g} MiB",
            )
            return stream.read(state.st_size + 1)  # memory for as much is taken at once
    except FileNotFoundError:
        raise InputError(source, "does not exist", "check the path") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{source!a:.80}", "is not a path", "check the path") from None
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(f"{source:.200}", f"cannot be read ({reason})", "check the path") from None


def read_text(path: str | Path, most: int = 64 * MIB) -> str:
    """Return the text of ``path`` in UTF-8; as :func:`read_bytes`.

    Raises
    ------
    InputError
        As :func:`read_bytes`, or if the content is not UTF-8.
    """
    content = read_bytes(path, most)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            str(path),
            f"cannot be read ({error.reason} at byte {error.start})",
            "give a text file in UTF-8",
        ) from None
