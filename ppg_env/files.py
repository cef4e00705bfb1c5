"""Files are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from ppg_env.errors import InputError, require


def write_atomically(path: str | Path, content: str | bytes) -> Path:
    """Write ``content`` to ``path`` through a temporary file beside it, and return the path.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be written to; an old file is then untouched.
    """
    target = Path(path)
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
            "choose a folder that exists and is yours",
        ) from None
    return target


def check_folder(path: str | Path) -> None:
    """Refuse a file in a folder that does not exist, before any work is done for it."""
    folder = Path(path).parent
    require(
        folder.is_dir(),
        str(path),
        f"cannot be written (there is no folder {str(folder)!r})",
        "choose a folder that exists and is yours",
    )


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
