"""Bits where they show: weights are squared derivatives of pictures, offsets follow them, encoders follow those."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.cropping import crop_layers
from facefolds_core.asset.packing import MACROBLOCK, AtlasLayout
from facefolds_core.asset.regions import Region
from facefolds_core.asset.video import decode_video, encode_video, pack_frame, unpack_picture
from facefolds_core.asset.writer import LevelContent
from facefolds_core.packaging.attention import block_weights, merged, offsets, regions_of, views_of
from facefolds_core.params import AttentionParams, VideoCodec
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import composite
from tests.vectors import FRAMES, LAYERS, RATE, TEXELS, WINDOW, Waves, cameras, sheet

USUAL = AttentionParams(strength=2.0)


class Changed:
    """Smooth textures, with one macroblock of one layer brighter or more opaque."""

    def __init__(self, layer: int, channels: slice, by: int) -> None:
        self._layer, self._channels, self._by = layer, channels, by

    def image(self, layer: int, frame: int, /) -> np.ndarray:
        s, t = np.meshgrid(*[(np.arange(TEXELS) + 0.5) / TEXELS] * 2)
        waves = [0.5 + 0.3 * np.sin(9 * s + 6 * t + channel + layer + frame) for channel in range(3)]
        alpha = np.clip(1.5 - 3.1 * np.hypot(s - 0.5, t - 0.5), 0, 1) * (0.9, 0.5, 1.0)[layer]
        image = np.rint(255 * np.stack([*waves, alpha], -1)).astype(int)
        if layer == self._layer:
            image[28:44, 28:44, self._channels] += self._by
        return np.clip(image, 0, 255).astype(np.uint8)


def content(textures: Waves | Changed, frames: int = 1) -> LevelContent:
    layers = crop_layers([sheet(n, 24) for n in range(LAYERS)], [WINDOW] * LAYERS, Waves(), FRAMES)
    return LevelContent(layers, textures, frames, RATE)


@pytest.mark.parametrize("layer", range(LAYERS))
@pytest.mark.parametrize("alpha", [False, True])
def test_weights_are_squared_derivatives_of_pictures(layer: int, alpha: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against pictures by the reference renderer of textures with one square of 16 x 16 texels changed."""
    step, channels = (8, slice(3, 4)) if alpha else (20, slice(0, 3))
    full, camera = content(Changed(layer, channels, 0)), cameras()[0]
    hits = cast_layers(camera, [layer.mesh for layer in full.layers])
    low, high = (composite(hits, content(Changed(layer, channels, by)).frame(0))[0] for by in (-2 * step, 0))
    squares = float(((high.astype(float) - low) ** 2).mean(-1).sum()) * (255 / (2 * step)) ** 2
    # In the picture, the changed square; blocks that it lies across.
    layout, crop = full.layout, full.layers[layer].crop
    x, y = layout.rects[layer][0] + 28 - crop[0], layout.rects[layer][1] + 28 - crop[1]
    y += layout.alpha_rect[1] if alpha else 0
    monkeypatch.setattr("facefolds_core.packaging.attention.RAYS_PER_CAMERA", 10**6)
    weights = np.kron(block_weights(full, views_of(full, [camera]), [0]), np.ones((MACROBLOCK, MACROBLOCK)))
    # Blocks lie across the square's border, and the reference shares a pixel among four texels. Seen: 1.01 to 1.05.
    assert weights[y : y + 16, x : x + 16].sum() == pytest.approx(squares, rel=0.15)


def test_a_fourth_of_the_weight_is_four_steps_and_the_least_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("facefolds_core.packaging.attention.LEAST", 1 / 64)
    weights = np.array([[1.0, 1.0, 0.25, 0.25, 1e-9, 0.0]])
    found = offsets(weights, 2.0)[0]
    assert found[2] - found[0] == 4
    assert found[4] == found[5] == found[0] + 12
    assert found[:4].mean() == 0  # about none where something shows


def test_where_nothing_shows_nothing_is_marked() -> None:
    assert (offsets(np.zeros((3, 4)), 2.0) == 0).all()


def test_no_cameras_or_no_strength_is_no_region() -> None:
    assert regions_of(content(Waves()), [], USUAL) == ()
    assert regions_of(content(Waves()), cameras(), AttentionParams(strength=0)) == ()


def test_regions_are_the_steps_without_overlap() -> None:
    steps = np.random.default_rng(0).integers(-2, 3, (9, 13))
    steps[3:6, 2:9] = 4
    found = np.zeros((9 * MACROBLOCK, 13 * MACROBLOCK), int)
    times = np.zeros_like(found)
    for region in merged(steps):
        place = np.s_[region.y : region.y + region.height, region.x : region.x + region.width]
        found[place], times[place] = region.offset, times[place] + 1
    np.testing.assert_array_equal(found, np.kron(steps, np.ones((MACROBLOCK, MACROBLOCK), int)))
    assert times.max() == 1
    assert len(merged(np.full((9, 13), 5))) == 1


def test_h264_codes_a_region_as_it_is_told(tmp_path: Path) -> None:
    """Noise of the same kind left and right: the side that is marked as finer has the smaller error."""
    textures = np.random.default_rng(0).integers(60, 190, (4, 128, 256, 4)).astype(np.uint8)
    layout, codec = AtlasLayout.pack([(256, 128)]), CODECS["h264"]
    size = (layout.width, layout.height)
    regions = [Region(0, 0, 128, layout.height, -8), Region(128, 0, layout.width - 128, layout.height, 8)]
    path = tmp_path / "regions.mp4"
    options = codec.options(VideoCodec(preset="medium"), 26)
    pictures = (pack_frame([texture], layout) for texture in textures)
    assert encode_video(path, pictures, size, Fraction(30), codec, options, regions) == 4
    for texture, picture in zip(textures, decode_video(path, size, 30.0), strict=True):
        error = np.abs(unpack_picture(picture, layout)[0][..., 3].astype(int) - texture[..., 3])
        assert error[:, :112].mean() < 0.5 * error[:, 144:].mean()


def test_what_is_seen_gets_the_bits() -> None:
    """The middle of the outermost layer shows; the same place of the innermost lies behind two others."""
    full = content(Waves(), frames=FRAMES)
    found = regions_of(replace(full), cameras()[:1], USUAL)

    def offset(layer: int) -> int:
        x, y, width, height = full.layout.rects[layer]
        at = x + width // 2, y + height // 2
        inside = (r for r in found if r.x <= at[0] < r.x + r.width and r.y <= at[1] < r.y + r.height)
        return next((region.offset for region in inside), 0)

    assert offset(0) + 6 <= offset(2)
