"""The Pareto frontier: the points that nothing else beats."""

from __future__ import annotations

from collections.abc import Sequence


def frontier(points: Sequence[tuple[float, float]], up: bool = True) -> list[int]:
    """Indices of the points (cost, value) that no other point beats in one and equals in the other, by rising cost.

    Of equal points the first one is kept.

    Args:
        up: larger values are better; smaller costs always are.
    """
    sign = 1 if up else -1
    best, chosen = float("-inf"), []
    for i in sorted(range(len(points)), key=lambda i: (points[i][0], -sign * points[i][1])):
        if sign * points[i][1] > best:
            best = sign * points[i][1]
            chosen.append(i)
    return chosen
