"""What lies apart from the subject in the textures."""

from __future__ import annotations

import numpy as np

from facefolds_core.params import PruningParams
from facefolds_core.training.explicit.clearing import specks

SHARE = PruningParams().speck_share


def _head() -> np.ndarray:
    opacity = np.zeros((60, 60))
    opacity[10:50, 10:40] = 1.0
    return opacity


def test_a_splinter_goes_and_the_head_with_its_soft_edge_stays() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    opacity[20, 40:42] = 0.1  # hair
    apart, count = specks(opacity, SHARE)
    assert count == 1 and apart[30:34, 50:52].all()
    assert not apart[10:50, 10:40].any() and not apart[20, 40:42].any()


def test_a_large_second_body_stays() -> None:
    opacity = _head()
    opacity[10:50, 48:55] = 0.8  # a fifth of the head's
    apart, count = specks(opacity, SHARE)
    assert count == 0 and not apart[10:50, 48:55].any()


def test_fog_far_from_everything_goes_with_the_splinters() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    opacity[2:5, 50:58] = 0.1
    assert specks(opacity, SHARE)[0][2:5, 50:58].all()


def test_nothing_is_taken_where_there_are_no_splinters() -> None:
    opacity = _head()
    opacity[2:5, 50:58] = 0.1
    assert not specks(opacity, SHARE)[0].any()
    assert not specks(np.zeros((4, 4)), SHARE)[0].any()


def test_all_can_be_kept() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    apart, count = specks(opacity, 0.0)
    assert count == 0 and not apart.any()
