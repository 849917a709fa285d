"""What lies apart from the subject in the textures."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.training.explicit.clearing import loose


def _head() -> np.ndarray:
    opacity = np.zeros((60, 60))
    opacity[10:50, 10:40] = 1.0
    return opacity


def test_a_splinter_goes_with_fog_and_the_head_with_its_soft_edge_stays() -> None:
    opacity = _head()
    opacity[30:34, 50:52] = 0.8
    opacity[20, 40:42] = 0.1  # hair
    opacity[2:5, 50:58] = 0.1  # fog
    apart = loose(opacity)
    assert apart[30:34, 50:52].all() and apart[2:5, 50:58].all()
    assert not apart[10:50, 10:40].any() and not apart[20, 40:42].any()


def test_a_large_second_body_stays() -> None:
    opacity = _head()
    opacity[10:50, 48:55] = 0.8  # a fifth of the head's
    assert not loose(opacity)[10:50, 48:55].any()


@pytest.mark.parametrize("opacity", [0.0, 0.2])
def test_nothing_goes_where_nothing_is_opaque(opacity: float) -> None:
    assert not loose(np.full((4, 4), opacity)).any()
