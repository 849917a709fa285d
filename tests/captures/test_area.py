"""The compiled area average is OpenCV's, but for rounding."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.captures.area_kernel import area_mean
from facefolds_core.captures.images import downsample


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("size", [(40, 30), (20, 15), (27, 29), (13, 1), (1, 7)])
def test_it_is_what_opencv_computes(size: tuple[int, int], channels: int) -> None:
    image = np.random.default_rng(0).integers(0, 256, (30, 40, channels), dtype=np.uint8)
    found = area_mean(image, *size)
    assert (found.shape, found.dtype) == ((size[1], size[0], channels), np.float32)
    np.testing.assert_allclose(found, downsample(image, *size), atol=1e-3)


def test_padded_rows_are_read_in_place() -> None:
    padded = np.random.default_rng(0).integers(0, 256, (30, 50, 3), dtype=np.uint8)
    np.testing.assert_array_equal(area_mean(padded[:, :40], 13, 11), area_mean(padded[:, :40].copy(), 13, 11))


def test_whole_numbers_are_the_nearest() -> None:
    image = np.random.default_rng(0).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    np.testing.assert_array_equal(area_mean(image, 20, 15, whole=True), np.round(area_mean(image, 20, 15)))
