"""Atomic writes: a file is written completely or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from ppg_env.errors import InputError, require


def write_atomically(path: str | Path, content: str | bytes) -> Path:
    """Write ``content`` to ``path`` through a temporary file in its folder, and return the path.

    Raises
    ------
    InputError
        If the folder does not exist or is not writable; an existing file is then unchanged.
    """
    target = Path(path).resolve()  # a symbolic link is followed and remains
    require(
        target.is_file() or not target.exists(),
        str(path),
        "cannot be written (it is not a regular file)",
        "name a file to write",
    )
    data = content.encode("utf-8") if isinstance(content, str) else content
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, target)
    except OSError as error:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)
        raise InputError(
            str(path),
            f"cannot be written ({error.strerror})",
            "choose an existing, writable folder",
        ) from None
    return Path(path)


def check_target(path: str | Path, *suffixes: str, ours: Path | None = None) -> None:
    """Refuse a path whose folder does not exist or whose ending is none of ``suffixes``.

    Call it before the work for the file starts.  The folder ``ours`` need not exist yet.

    Raises
    ------
    InputError
        If the path cannot be the target of a write.
    """
    *others, last = suffixes
    kinds = f"{', '.join(others)} or {last}" if others else last
    only = "the supported formats" if others else "the only supported format"
    require(
        Path(path).suffix.lower() in suffixes,
        str(path),
        f"does not end in {kinds}",
        f"name a {kinds} file, {only}",
    )
    require(not Path(path).is_dir(), str(path), "is a folder", f"name a {kinds} file to write")
    folder = Path(path).parent
    require(
        folder == ours or folder.is_dir(),
        str(path),
        f"cannot be written (there is no folder {str(folder)!r})",
        "choose an existing, writable folder",
    )


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
