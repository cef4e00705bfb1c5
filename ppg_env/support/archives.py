"""Files of arrays: what can be wrong with one, in a sentence."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager

from ppg_env.errors import InputError


@contextmanager
def readable_archive(source: str, remedy: str) -> Iterator[None]:
    """Turn errors while the .npz file ``source`` is read into an InputError with ``remedy``."""
    try:
        yield
    except FileNotFoundError:
        raise InputError(source, "does not exist", "check the path") from None
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as error:
        raise InputError(source, f"cannot be read ({type(error).__name__})", remedy) from None
    except zipfile.BadZipFile:
        raise InputError(source, "cannot be read (no archive)", remedy) from None
