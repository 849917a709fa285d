"""The subject's colours around a pixel, by their means at half the size, against the plain Gaussian."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from facefolds_core.subject.known_background import DEVIATION, SPREAD, _NearbyColours


@pytest.mark.parametrize("size", [(60, 80), (61, 79)])
def test_mean_and_covariance_are_those_of_a_gaussian_neighbourhood(size: tuple[int, int]) -> None:
    random = np.random.default_rng(0)
    colours = cv2.GaussianBlur(random.random((*size, 3)).astype(np.float32), (0, 0), 2.0)
    opacity = (random.random(size) * (random.random(size) > 0.3)).astype(np.float32)
    first = opacity * (np.arange(size[1]) < 40)
    found = _NearbyColours(colours, first)
    rest = np.nonzero(opacity - first)
    found.add(rest, colours[rest], opacity[rest])
    asked = random.integers(10, 50, (2, 200))
    mean, covariance = found.around((asked[0], asked[1]))

    def near(values: np.ndarray) -> np.ndarray:
        return cv2.GaussianBlur(values * opacity**2, (0, 0), SPREAD)[asked[0], asked[1]]

    for k in range(3):
        expected = near(colours[..., k]) / near(np.ones(size, np.float32))
        np.testing.assert_allclose(mean[:, k], expected, atol=2e-3)
        square = near(colours[..., k] ** 2) / near(np.ones(size, np.float32)) - expected**2
        np.testing.assert_allclose(covariance[:, k, k] - DEVIATION**2, square, atol=2e-4)


def test_far_from_all_that_is_known_the_nearest_colours_count() -> None:
    colours, opacity = np.full((40, 400, 3), 0.25, np.float32), np.zeros((40, 400), np.float32)
    opacity[:, :10] = 1
    mean, _ = _NearbyColours(colours, opacity).around((np.array([20]), np.array([390])))
    np.testing.assert_allclose(mean, 0.25, atol=1e-5)
