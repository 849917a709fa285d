"""Some of many, evenly spaced: which cameras, frames or pictures stand for all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def spread(items: Sequence[T], most: int, *, ends: bool = True) -> list[T]:
    """At most `most` of the items, evenly spaced and in their order; `range(n)` gives indices.

    Args:
        ends: the first and the last are among them (with `most` of 1 the first alone); otherwise the middle of each
            of as many equal parts.
    """
    wanted = min(most, len(items))
    if ends:
        places = np.linspace(0, len(items) - 1, wanted)
    else:
        places = (np.arange(wanted) + 0.5) * len(items) / max(1, wanted) - 0.5
    return [items[round(float(place))] for place in places]
