"""Closed-form matting: what it is exact for, what it does where colours say nothing."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.subject.closed_form import closed_form

Y, X = np.mgrid[:40, :40]
AWAY = np.hypot(X - 20, Y - 20)
NOTHING = np.zeros((40, 40), np.float32)


def blended(opacity: np.ndarray) -> np.ndarray:
    """(H, W, 3) float32: skin before a green wall."""
    wall, skin = np.float32([[0.2, 0.4, 0.1], [0.8, 0.6, 0.5]])
    return np.asarray(wall + opacity[..., None] * (skin - wall), np.float32)


@pytest.mark.parametrize("width", [1.0, 4.0, 8.0])
def test_it_is_exact_between_two_colours(width: float) -> None:
    """Levin et al. 2008, section 3: then the true matte costs nothing."""
    opacity = np.clip((12 - AWAY) / width + 0.5, 0, 1)
    found = closed_form(blended(opacity), AWAY < 7, (AWAY >= 7) & (AWAY < 18), NOTHING, NOTHING)
    assert np.abs(found - opacity).max() < 0.01


def test_what_is_known_stays() -> None:
    inside = AWAY < 9
    found = closed_form(blended(NOTHING), inside, np.zeros_like(inside), NOTHING + 0.5, NOTHING + 1)
    np.testing.assert_array_equal(found, inside)


def test_where_all_has_one_colour_the_prior_decides() -> None:
    grey, unknown = np.full((40, 40, 3), 0.5, np.float32), (AWAY >= 6) & (AWAY < 18)
    prior = np.clip((14 - AWAY) / 4 + 0.5, 0, 1).astype(np.float32)
    sure, unsure = (closed_form(grey, AWAY < 6, unknown, prior, NOTHING + weight) for weight in (1e3, 0))
    assert np.abs(sure - prior)[unknown].max() < 0.02
    assert np.abs(unsure - prior)[unknown].max() > 0.2
    assert np.isfinite(unsure).all()


def test_what_touches_nothing_known_is_what_the_prior_says() -> None:
    """A picture that is unknown as a whole."""
    found = closed_form(blended(NOTHING), np.zeros((40, 40), bool), np.ones((40, 40), bool), NOTHING + 0.3, NOTHING)
    np.testing.assert_allclose(found, 0.3, atol=1e-3)
