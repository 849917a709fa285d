"""numba with types that mypy sees, and a cache on disk that notices every change of the actor's code."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

# Reordering is welcome, but infinities stand for "no surface" and must survive.
_FASTMATH = {"contract", "afn", "arcp", "nsz", "reassoc"}


def compiled(function: F) -> F:
    """Compile a small function; it is built into the kernels that call it."""
    return cast(F, numba.njit(fastmath=_FASTMATH, error_model="numpy")(function))


def kernel(function: F) -> F:
    """Compile an entry point, run its `prange` in parallel, keep the machine code on disk.

    numba's cache looks at one source file only, the kernel's own. Kernels therefore close over `source_digest()`, whose
    value is part of the cache's key, so that an edit of any file of this package recompiles them.
    """
    return cast(F, numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)(function))


def source_digest() -> int:
    """CRC-32 of the sources of this package."""
    digest = 0
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest = zlib.crc32(path.read_bytes(), digest)
    return digest
