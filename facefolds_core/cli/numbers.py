"""Numbers on command lines: `nan` and `inf` pass for floats, and even for floats between two limits, in typer."""

from __future__ import annotations

import math

import typer


def finite(value: float | None) -> float | None:
    """For `callback=` of a float's option: the value, if it is a number.

    Raises:
        typer.BadParameter: which says so without a traceback, and names the option.
    """
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"expected a finite number, found {value}")
    return value
