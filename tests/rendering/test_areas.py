"""Means over pixels: the compiled renderer against the plain one, and what they are good for."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from facefolds_core.rendering.areas import AreaView, view_of
from facefolds_core.rendering.pixels import SIDE, finer, pixel_means, render
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import AssetCaster, Layered, composite
from facefolds_core.rendering.reflection import reflected_colours
from tests.assets import MOVING, Meshes, make_asset
from tests.pictures import psnr
from tests.rendering.test_raster import bumpy
from tests.scenes import look_at_origin
from tests.viewer.fixtures import random_reflection


@pytest.mark.parametrize("side", [1, 2, SIDE])
def test_a_pixel_is_the_mean_of_its_rays(side: int) -> None:
    image = np.arange(side * 2 * side * 3, dtype=np.float32).reshape(2 * side, 3 * side)
    found = pixel_means(image, side)
    assert found.shape == (2, 3)
    assert found[0, 0] == pytest.approx(image[:side, :side].mean())


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_it_shows_what_the_plain_renderer_shows(dtype: type) -> None:
    """More rows than are cast at once; layers of different sizes, missed by some rays."""
    camera, layers = look_at_origin("camera", 40, 10, 80), [bumpy(0), bumpy(1), bumpy(2)]
    rng = np.random.default_rng(0)
    bytes_ = [rng.integers(0, 256, (16, 20 + i, 4), dtype=np.uint8) for i in range(3)]
    textures = bytes_ if dtype is np.uint8 else [(one / np.float32(255)).astype(np.float32) for one in bytes_]
    background = rng.uniform(0, 1, 3)
    hits = AssetCaster(Meshes(layers)).cast(finer(camera))
    expected = [pixel_means(one) for one in composite(hits, bytes_, background)]
    view = AreaView.of_hits(camera, lambda part: (cast_layers(part, layers), None))
    for found, plain in zip(view.composite(textures, background), expected, strict=True):
        np.testing.assert_allclose(found, plain, atol=2e-3 if hits.hit.any(-1).any() else 0)
        assert np.abs(found - plain).mean() < 1e-5  # rays that touch a silhouette are a matter of rounding


def test_an_asset_is_seen_with_its_reflection_and_without(tmp_path: Path) -> None:
    level, maps = make_asset(tmp_path / "asset", layers=2, frames=1, resolution=32).full, random_reflection()
    shining = SimpleNamespace(layers=level.layers, windows=level.windows, frame=level.frame, reflection=lambda: maps)
    camera = look_at_origin("camera", 20, 0, 24)
    fine, textures = finer(camera), level.frame(0)
    hits = AssetCaster(level).cast(fine)
    view = view_of(cast(Layered, shining), camera)
    found = [view.composite(textures, lit=lit)[0] for lit in (True, False)]
    for picture, added in zip(found, (reflected_colours(hits, fine, level.windows, maps), None), strict=True):
        assert np.abs(picture - pixel_means(composite(hits, textures, added=added)[0])).max() < 1e-4
    assert np.abs(found[0] - found[1]).max() > 0.01
    plain, _ = render(cast(Layered, shining), camera, 0)
    assert np.abs(found[0] - plain).max() < 1e-4


def test_the_plain_picture_and_the_compiled_one_are_the_same(tmp_path: Path) -> None:
    """More rows than are cast at once; an asset whose head turns, and a background that is a picture."""
    asset = make_asset(tmp_path / "asset", layers=3, frames=3, resolution=48, source=MOVING)
    camera = look_at_origin("camera", 30, 10, 150)
    background = np.random.default_rng(0).uniform(0, 1, (150, 150, 3)).astype(np.float32)
    plain = render(asset, camera, 2, background)
    for found, expected in zip(view_of(asset, camera, 2).composite(asset.frame(2), background), plain, strict=True):
        assert psnr(found, expected) > 60  # rays that touch a silhouette are a matter of rounding
    assert psnr(render(asset, camera, 0, background)[0], plain[0]) < 40


def test_a_photo_of_an_edge_is_grey_where_the_edge_is() -> None:
    """Black and white texels that meet within a pixel: one ray sees one of them, the area both."""
    camera = look_at_origin("camera", 0, 0, 9)
    square = bumpy(0, 2)
    flat = type(square)(square.vertices * np.float32([0, 1, 1]), square.faces, square.st)
    texture = np.full((64, 64, 4), 255, np.uint8)
    texture[:, :32, :3] = 0
    view = AreaView.of_hits(camera, lambda part: (cast_layers(part, [flat]), None))
    middle = view.composite([texture])[0][4, 4, 0]
    assert 0.2 < middle < 0.8
