"""The yardstick of packaging."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.packaging.views import MAX_PSNR, ViewMeter
from tests.assets import cap_mesh, cap_textures, radius_of
from tests.scenes import look_at_origin

CAMERAS = [look_at_origin(f"c{i}", azimuth, 0, 40) for i, azimuth in enumerate((-20, 0, 20))]


def meter(textures: np.ndarray) -> ViewMeter:
    return ViewMeter([cap_mesh(radius_of(i)) for i in range(len(textures))], CAMERAS, {0: list(textures)})


def test_the_reference_itself_is_perfect() -> None:
    textures = cap_textures(2, 0, 32)
    assert meter(textures).psnr([(0, list(textures))]) == MAX_PSNR


def test_a_constant_error_of_an_opaque_layer_has_its_psnr() -> None:
    textures = np.full((1, 16, 16, 4), 100, np.uint8)
    textures[..., 3] = 255
    wrong = textures.copy()
    wrong[..., :3] += 10
    assert meter(textures).psnr([(0, list(wrong)), (7, [])]) == pytest.approx(-20 * np.log10(10 / 255), abs=1e-4)


def test_what_is_hidden_costs_nothing() -> None:
    textures = np.full((2, 16, 16, 4), 100, np.uint8)
    textures[..., 3] = 255
    wrong = textures.copy()
    wrong[1, ..., :3] = 0
    # The outer cap covers the inner one but along the rim of its own outline.
    assert meter(textures).psnr([(0, list(wrong))]) > 30
