"""Errors of mattes that are known, and the parts of masks."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.scoring.matte import interior_and_band, matte_errors


def square(left: int = 10) -> np.ndarray:
    """20 x 20 of 40 x 40 pixels."""
    mask = np.zeros((40, 40))
    mask[10:30, left : left + 20] = 1
    return mask


@pytest.mark.parametrize("by", [0, 1, 3])
def test_a_shifted_matte_has_a_known_error(by: int) -> None:
    errors = matte_errors(square(10 + by), square(10))
    wrong = 2 * by * 20  # a column of 20 pixels lost and one gained, for each pixel of the shift
    assert errors["matte_sad"] == pytest.approx(wrong / 1000)
    assert errors["matte_mse"] == pytest.approx(wrong / 1600)
    assert errors["matte_iou"] == pytest.approx((400 - wrong / 2) / (400 + wrong / 2))


def test_half_the_opacity_is_half_the_error() -> None:
    errors = matte_errors(0.5 * square(), square())
    assert errors["matte_sad"] == pytest.approx(0.2)
    assert errors["matte_mse"] == pytest.approx(400 * 0.25 / 1600)
    assert matte_errors(0 * square(), 0 * square())["matte_iou"] == 1  # two empty ones agree


def test_the_gradient_of_a_wide_ramp_is_its_slope() -> None:
    ramp = np.tile(np.arange(60) / 60, (60, 1))
    error = matte_errors(ramp, np.zeros((60, 60)))["matte_gradient"]
    inner = 60 * 50 / 60**2 / 1000  # columns that the frame's edge does not touch
    assert inner < error < 1.2 * inner


def test_a_square_is_eroded_and_dilated_by_the_band() -> None:
    interior, band = interior_and_band(square(), 4)
    assert interior.sum() == 12**2  # 4 pixels off on each side
    assert interior[14, 14] and not interior[13, 20]
    assert band[6, 20] and not band[5, 20]
    assert not (band & interior).any()
    # The dilated square: four strips, and quarters of discs of radius 4 in the corners.
    corner = sum(x**2 + y**2 <= 16 for x in range(1, 5) for y in range(1, 5))
    assert band.sum() == 20**2 - 12**2 + 4 * 4 * 20 + 4 * corner


def test_the_edge_of_the_frame_is_no_outline() -> None:
    mask = np.zeros((20, 20))
    mask[8:] = 1  # a bust that the frame cuts
    interior, band = interior_and_band(mask, 3)
    np.testing.assert_array_equal(interior[:, 0], np.arange(20) >= 11)
    np.testing.assert_array_equal(band[:, 19], (np.arange(20) >= 5) & (np.arange(20) < 11))


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_a_mask_without_an_outline_has_no_band(value: float) -> None:
    interior, band = interior_and_band(np.full((9, 9), value), 2)
    assert (interior.all() if value else not interior.any()) and not band.any()
