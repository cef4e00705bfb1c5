"""The compiled kernel, imported at its first use: that takes longer than all else here."""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType


@lru_cache(maxsize=1)
def compiled_kernel() -> ModuleType:
    """Return :mod:`ppg_env.env.kernel`; an import statement in every step would take longer."""
    from ppg_env.env import kernel

    return kernel
