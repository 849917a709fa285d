"""What the actor says, as the mouth shows it: visemes that blend into one another.

"Hello there. How do you do? I'm fine." Each sound pulls the mouth towards its own shape for a while before and after
its time; the mouth is the mean of the shapes, weighted by how strongly each pulls (Cohen and Massaro, "Modeling
coarticulation in synthetic visual speech", 1993). Sounds that need closed lips pull hardest: at "m" the mouth shuts.
"""

from __future__ import annotations

import math

_REACH = 0.065
"""Seconds from a sound's time at which its pull has fallen to 1/e: half a syllable."""
_REST = 0.06
"""Pull of the mouth at rest, always there; it has the mouth to itself between words."""

_SOUNDS = (
    # seconds, opening, rounding, stretching, pull
    (0.14, 0.10, 0.00, 0.10, 0.8),  # h
    (0.25, 0.62, 0.00, 0.30, 1.0),  # e
    (0.37, 0.28, 0.00, 0.15, 0.8),  # l
    (0.50, 0.80, 0.55, 0.00, 1.2),  # o
    (0.64, 0.16, 0.10, 0.10, 0.9),  # th
    (0.75, 0.58, 0.00, 0.40, 1.0),  # e
    (0.87, 0.20, 0.25, 0.00, 0.8),  # re
    (1.68, 0.18, 0.00, 0.00, 0.7),  # h
    (1.80, 0.85, 0.00, 0.10, 1.1),  # a
    (1.93, 0.30, 0.80, 0.00, 1.0),  # w
    (2.03, 0.12, 0.30, 0.00, 0.9),  # d
    (2.14, 0.28, 1.00, 0.00, 1.0),  # o
    (2.25, 0.14, 0.20, 0.40, 0.8),  # y
    (2.36, 0.26, 0.90, 0.00, 1.0),  # ou
    (2.48, 0.12, 0.30, 0.00, 0.9),  # d
    (2.62, 0.34, 1.00, 0.00, 1.2),  # o
    (3.02, 0.72, 0.00, 0.15, 1.1),  # I
    (3.15, 0.00, 0.00, 0.00, 3.0),  # m
    (3.26, 0.04, 0.00, 0.10, 1.2),  # f
    (3.40, 0.68, 0.00, 0.35, 1.1),  # i
    (3.54, 0.14, 0.00, 0.35, 0.9),  # ne
)

PHRASES = (("Hello there.", 0.08, 0.95), ("How do you do?", 1.62, 2.75), ("I'm fine.", 2.96, 3.66))
"""The words, and the seconds from and to which the mouth says them."""


def mouth_at(time: float, period: float) -> tuple[float, float, float]:
    """How far the mouth is opened, rounded and stretched, each in [0, 1], at a time in seconds (periodic)."""
    total, opened, rounded, stretched = _REST, 0.0, 0.0, 0.0
    for at, opening, rounding, stretching, pull in _SOUNDS:
        away = (time - at + 0.5 * period) % period - 0.5 * period
        weight = pull * math.exp(-((away / _REACH) ** 2))
        total += weight
        opened += weight * opening
        rounded += weight * rounding
        stretched += weight * stretching
    return opened / total, rounded / total, stretched / total
