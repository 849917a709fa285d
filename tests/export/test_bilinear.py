"""Texels on another grid: least squares against look-ups."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.export.bilinear import Bands, Projection, _along, interpolation

PLACES = (np.arange(997) + 0.5) / 997


def smooth_noise(size: int) -> np.ndarray:
    """(size, size, 2) float32 in [0, 1], from one texel to the next anything."""
    return np.random.default_rng(0).random((size, size, 2), np.float32)


def shown(image: np.ndarray) -> np.ndarray:
    """What interpolation between texels (H, W, C) shows at PLACES in both directions."""
    down, along = (interpolation(PLACES, size) for size in image.shape[:2])
    return np.einsum("ph,hwc,qw->pqc", down, image, along, optimize=True)


def looked_up(image: np.ndarray, size: int) -> np.ndarray:
    """The image at the texel centres of a grid of `size` a side."""
    centres = (np.arange(size) + 0.5) / size
    down, along = (interpolation(centres, side) for side in image.shape[:2])
    return np.einsum("ph,hwc,qw->pqc", down, image, along)


@pytest.mark.parametrize("size", [17, 31])
def test_nearer_to_the_picture_than_look_ups(size: int) -> None:
    image = smooth_noise(24)
    errors = [
        float(((shown(texels) - shown(image)) ** 2).mean())
        for texels in (Projection((24, 24), (size, size))(image), looked_up(image, size))
    ]
    assert errors[0] < 0.85 * errors[1]


@pytest.mark.parametrize(("source", "target"), [(300, 517), (300, 100), (7, 200), (1, 70)])
def test_blocks_of_rows_give_what_the_whole_matrix_gives(source: int, target: int) -> None:
    weights, _ = _along(source, target, 0.1, 0.8)
    values = np.random.default_rng(1).random((source, 5), np.float32)
    assert np.abs((Bands(weights) @ values) - weights @ values).max() < 2e-6  # a code of 255 is 4e-3
    assert (Bands(np.zeros((70, 9), np.float32)) @ np.ones((9, 2), np.float32) == 0).all()


def test_the_same_grid_keeps_every_texel_and_beyond_the_image_its_border_goes_on() -> None:
    image = smooth_noise(16)
    assert np.abs(Projection((16, 16), (16, 16))(image) - image).max() < 1e-5
    grey = np.full((8, 8, 1), 0.5, np.float32)
    assert np.abs(Projection((8, 8), (16, 16), (-1.0, 2.0, -1.0, 2.0))(grey) - 0.5).max() < 1e-6


def test_a_finer_grid_over_whole_texels_shows_the_same() -> None:
    ramp = np.linspace(0.2, 0.8, 12, dtype=np.float32)[:, None, None].repeat(12, 1)
    box = (0.25, 0.75, 0.25, 0.75)
    finer = Projection((12, 12), (24, 24), box)(ramp)[:, 0, 0]
    centres = 0.25 + 0.5 * (np.arange(24) + 0.5) / 24
    assert np.abs(finer - interpolation(centres, 12) @ ramp[:, 0, 0])[2:-2].max() < 1e-3


def test_an_edge_does_not_overshoot() -> None:
    image = np.zeros((20, 20, 1), np.float32)
    image[:, 10:] = 1
    found = Projection((20, 20), (33, 33))(image)
    assert found.min() >= 0
    assert found.max() <= 1
    assert (found[:, :14] == 0).all()
