"""Some of many, evenly spaced."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.spacing import spread


@pytest.mark.parametrize(
    ("count", "most", "ends", "middles"),
    [
        *((10, 3, [0, 4, 9], [1, 4, 8]), (12, 3, [0, 6, 11], [2, 6, 10]), (10, 2, [0, 9], [2, 7]), (9, 1, [0], [4])),
        *((2, 5, [0, 1], [0, 1]), (1, 1, [0], [0]), (0, 4, [], []), (4, 0, [], [])),
    ],
)
def test_ends_are_among_them_or_each_is_the_middle_of_its_part(
    count: int, most: int, ends: list[int], middles: list[int]
) -> None:
    assert spread(range(count), most) == ends
    assert spread(range(count), most, ends=False) == middles


@pytest.mark.parametrize("ends", [True, False])
def test_gaps_differ_by_one_at_most_and_nothing_comes_twice(ends: bool) -> None:
    for count in range(1, 40):
        for most in range(1, 45):
            found = spread(range(count), most, ends=ends)
            gaps = np.diff(found)
            assert len(found) == min(count, most)
            assert len(found) == 1 or (gaps.min() > 0 and np.ptp(gaps) <= 1)


def test_items_come_in_their_order() -> None:
    assert spread("jihgfedcba", 3) == ["j", "f", "a"]
