"""Lens models: the formulas against OpenCV's, photos through a lens and back, numbers that are no lens."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.captures.lens import Lens, make_lens, undistort
from facefolds_core.errors import UserError
from tests.filmed import film

Array = NDArray[np.float64]
K = np.array([[300.0, 0, 161.5], [0, 310.0, 118.2], [0, 0, 1]])
SIZE = (320, 240)
FISHEYES = [(0.0, 0.0, 0.0, 0.0), (-0.02, 0.01, -0.004, 0.0007), (0.03, 0.006, 0.0004, 0.0001)]
RATIONAL = (-0.1, 0.02, 0.001, -0.002, 0.003, 0.04, -0.01, 0.002)


def points() -> Array:
    """Points of the image plane, up to 50 degrees off the axis."""
    return np.random.default_rng(0).uniform(-0.85, 0.85, (200, 2))


@pytest.mark.parametrize("coefficients", FISHEYES)
def test_the_fisheye_formula_is_opencvs(coefficients: tuple[float, ...]) -> None:
    expected = cv2.fisheye.distortPoints(points()[:, None], K, np.array(coefficients))[:, 0]
    lens = Lens(K, np.array(coefficients), K, fisheye=True)
    assert lens.distort(points()) == pytest.approx(expected, abs=1e-9)
    assert lens.distort(np.zeros((1, 2)))[0] == pytest.approx(K[:2, 2])  # its axis


def test_the_rational_formula_is_opencvs() -> None:
    ideal = np.concatenate([points(), np.ones((200, 1))], 1)
    expected = cv2.projectPoints(ideal, np.zeros(3), np.zeros(3), K, np.array(RATIONAL))[0][:, 0]
    assert Lens(K, np.array(RATIONAL), K).distort(points()) == pytest.approx(expected, abs=1e-9)


def through(lens: Lens, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The photo that the lens takes of a pinhole image (inverse of `undistort`, by OpenCV's own inverse)."""
    height, width = image.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    photo = np.stack([x, y], -1).reshape(-1, 1, 2) + 0.5
    if lens.fisheye:
        straight = cv2.fisheye.undistortPoints(photo, lens.K, lens.coefficients, P=lens.pinhole)
    else:
        exact = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-9)
        straight = cv2.undistortPoints(photo, lens.K, lens.coefficients, P=lens.pinhole, criteria=exact)
    source = (straight.reshape(height, width, 2) - 0.5).astype(np.float32)
    return np.asarray(cv2.remap(image, source[..., 0], source[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT))


@pytest.mark.parametrize("coefficients", [*FISHEYES, RATIONAL])
def test_the_actor_comes_back_from_behind_the_lens(coefficients: tuple[float, ...]) -> None:
    small = film().images[0, 0]
    image = cv2.GaussianBlur(cv2.resize(small, SIZE, interpolation=cv2.INTER_CUBIC), (0, 0), 2)
    lens = make_lens(K, np.array(coefficients), *SIZE, "file", "camera", fisheye=len(coefficients) == 4)
    photo = through(lens, image)
    back = undistort(photo, lens.maps(*SIZE))
    inner = (slice(8, -8), slice(8, -8))
    assert np.mean((photo[inner].astype(float) - image[inner]) ** 2) > 30  # the lens does bend
    assert np.mean((back[inner].astype(float) - image[inner]) ** 2) < 0.5


def test_a_fisheye_without_coefficients_is_a_lens_and_a_pinhole_none() -> None:
    assert make_lens(K, np.zeros(4), *SIZE, "file", "camera", fisheye=True) is not None
    assert make_lens(K, np.zeros(5), *SIZE, "file", "camera") is None


@pytest.mark.parametrize("k1", [-5.0, 90.0])
def test_a_fisheye_that_folds_or_bursts_is_refused(k1: float) -> None:
    with pytest.raises(UserError, match="too strong to undo") as caught:
        make_lens(K, np.array([k1, 0, 0, 0]), *SIZE, "calibration.txt", "camera 3", fisheye=True)
    assert "camera 3" in str(caught.value) and "fisheye" in str(caught.value)
