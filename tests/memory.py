"""How much memory Python and NumPy ask for while something is done; what is mapped from files does not count."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable


def peak_of(work: Callable[[], object]) -> int:
    """Bytes at most that `work` and what it returns take together."""
    tracemalloc.start()
    try:
        kept = work()
        return tracemalloc.get_traced_memory()[1] + 0 * id(kept)
    finally:
        tracemalloc.stop()
