"""Images of captures: their size, colour, and formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.images import display_colour, downsample, fit_box
from facefolds_core.captures.picture import FilePicture
from tests.captures.fixtures import save


@pytest.mark.parametrize(
    ("size", "box", "expected"),
    [
        ((1334, 2048), (768, 500), (500, 768)),  # the paper's
        ((2048, 1334), (768, 500), (768, 500)),
        ((1368, 770), (768, 500), (768, 432)),
        ((250, 384), (768, 500), (250, 384)),  # never enlarged
    ],
)
def test_images_fit_the_box(size: tuple[int, int], box: tuple[int, int], expected: tuple[int, int]) -> None:
    assert fit_box(*size, *box) == expected


def test_downsampling_by_a_whole_factor_is_the_mean_of_blocks() -> None:
    image = np.random.default_rng(0).integers(0, 256, (12, 8, 3), dtype=np.uint8)
    expected = image.reshape(4, 3, 4, 2, 3).mean((1, 3))
    assert np.abs(downsample(image, 4, 4) - expected).max() < 1e-3


def test_display_colour_of_black_and_of_full_grey() -> None:
    values = display_colour(np.array([[[0, 0, 0], [255, 255, 255]]], np.float32))
    # Green: (1 - 3/255) * 0.95 / (1 - 3/255) = 0.95, root 0.9747, minus 15/255; red and blue are clipped.
    assert values[0, 0].tolist() == [0, 0, 0]
    assert values[0, 1, 1] == pytest.approx(255 * (0.95**0.5 - 15 / 255), abs=1e-2)
    assert values[0, 1].max() <= 255


@pytest.mark.parametrize(
    ("stored", "expected"),
    [
        (np.full((2, 3), 77, np.uint8), [77, 77, 77]),
        (np.full((2, 3), 77 * 257, np.uint16), [77, 77, 77]),
        (np.full((2, 3, 3), (10, 20, 30), np.uint8), [10, 20, 30]),
        (np.full((2, 3, 4), (200, 100, 50, 51), np.uint8), [40, 20, 10]),
    ],
)
def test_grey_16_bit_and_transparent_images_become_rgb(tmp_path: Path, stored: np.ndarray, expected: list[int]) -> None:
    save(tmp_path / "a.png", stored)
    image = FilePicture(tmp_path / "a.png").rgb("here")
    assert (image.shape, image.dtype, image[1, 2].tolist()) == ((2, 3, 3), np.uint8, expected)
