"""How the C library keeps memory: so that what a mesh took goes back to the system.

By itself glibc gives each thread a heap of its own, none of which shrinks while anything lives at
its end, and moves ever larger arrays there: a service of many sizes of meshes grows for hours.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable

from service.budget import MEBIBYTE

# Parameters of mallopt(3), by the environment variable of an operator who knows better.
_PARAMETERS = {
    "MALLOC_ARENA_MAX": (-8, 2),
    "MALLOC_MMAP_THRESHOLD_": (-3, 8 * MEBIBYTE),
    "MALLOC_TRIM_THRESHOLD_": (-1, 32 * MEBIBYTE),
}


def settle() -> None:
    """Two heaps for all threads, arrays from 8 MiB on outside of them, and 32 MiB kept for later.

    To be called before threads start; nothing happens where the C library is another.
    """
    mallopt = _function("mallopt")
    if mallopt is None:
        return
    for name, (parameter, value) in _PARAMETERS.items():
        if name not in os.environ:
            mallopt(parameter, value)


def trim() -> None:
    """Give back what lies free between what lives; takes some ms, and lets other threads run."""
    release = _function("malloc_trim")
    if release is not None:
        release(0)


def _function(name: str) -> Callable[..., int] | None:
    return getattr(ctypes.CDLL(None), name, None) if os.name == "posix" else None
