"""Progress bars that neither flood a log file nor keep a terminal waiting."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

from tqdm import tqdm


def progress(
    iterable: Iterable[Any] | None = None,
    *,
    desc: str,
    unit: str,
    total: int | None = None,
    initial: int = 0,
) -> Any:
    """A tqdm bar, redrawn 5 times a second on a terminal and once in 15 seconds elsewhere."""
    interval = 0.2 if sys.stderr.isatty() else 15.0
    return tqdm(
        iterable,
        desc=desc,
        unit=unit,
        total=total,
        initial=initial,
        mininterval=interval,
        maxinterval=max(10.0, interval),
    )
