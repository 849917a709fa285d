"""Grids of samples, their normals, and texture frames, against closed forms."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from facefolds_core.errors import UserError
from facefolds_core.export import sampling
from facefolds_core.export.sampling import grid_normals, sample_grids, samples_for, texture_rows, write_textures
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import FULL_WINDOW, Window, points_to_uv, row_strides, texel_uv, uv_to_directions
from facefolds_core.model.textures import TexelGrid
from tests.ellipsoids import Ellipsoids

WINDOW: Window = (-0.5, 0.6, -0.3, 0.4)


@pytest.mark.parametrize("window", [FULL_WINDOW, WINDOW])
def test_points_lie_on_the_layers_at_the_grids_uv_with_their_normals(window: Window) -> None:
    model = Ellipsoids()
    grids = sample_grids(model, 96, window)
    uv, _ = points_to_uv(grids.points.astype(np.float64), model.centre.numpy())
    assert np.abs(uv - texel_uv(96, 96, window)).max() < 1e-5
    for points, normals, axes in zip(grids.points, grids.normals, model.axes, strict=True):
        offset = points - model.centre.numpy()
        assert np.abs(np.linalg.norm(offset / np.array(axes), axis=-1) - 1).max() < 2.5e-6  # 1e-6 units
        true = offset / np.array(axes) ** 2
        true /= np.linalg.norm(true, axis=-1, keepdims=True)
        cosine = (true * normals).sum(-1)
        assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 2.0  # seen: 1.3, one-sided at the poles


def test_noise_of_the_search_does_not_turn_the_normals_at_the_poles() -> None:
    model = Ellipsoids(axes=((0.35, 0.35, 0.35), (0.30, 0.30, 0.30)))
    grids = sample_grids(model, 128, FULL_WINDOW)
    outward = grids.points[0] - model.centre.numpy()
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    noisy = grids.points[0] * (1 + 1e-5 * np.random.default_rng(0).standard_normal((128, 128, 1)))
    normals = grid_normals(noisy.astype(np.float32), grids.valid[0], model.chart, FULL_WINDOW)
    assert (normals * outward).sum(-1).min() > 0.98


def test_invalid_neighbours_do_not_bend_the_normals() -> None:
    model = Ellipsoids(hole=0.15)
    grids = sample_grids(model, 64, WINDOW)
    whole = sample_grids(Ellipsoids(), 64, WINDOW)
    assert not grids.valid.all()
    cosine = (grids.normals * whole.normals).sum(-1)[grids.valid]
    assert cosine.min() > 0.999


def test_a_lone_sample_gets_the_direction_of_its_ray() -> None:
    points = np.zeros((8, 8, 3), np.float32)
    points[3, 4] = (0.1, 0.0, 0.0)
    valid = np.zeros((8, 8), bool)
    valid[3, 4] = True
    normals = grid_normals(points, valid, Chart((-0.25, 0, 0)), FULL_WINDOW)
    assert np.allclose(normals[3, 4], uv_to_directions(texel_uv(8, 8, FULL_WINDOW)[3, 4]))
    assert np.isfinite(normals).all()


def test_rows_near_the_poles_span_more_columns() -> None:
    strides = row_strides(64, FULL_WINDOW)
    assert strides[32] == 1
    assert strides[0] == round(1 / np.cos((1 - 1 / 64) * np.pi / 2))


def test_textures_are_the_models(tmp_path: Path) -> None:
    model = Ellipsoids()
    grids = sample_grids(model, 16, WINDOW)
    write_textures(tmp_path / "textures.arrow", model, grids)
    store = FrameStore(tmp_path / "textures.arrow")
    rgb, alpha = model.texture(torch.as_tensor(texel_uv(16, 16, WINDOW).reshape(-1, 2)), 0, 1.0)
    expected = torch.cat([rgb, alpha[:, None]], 1).reshape(16, 16, 4).numpy()
    assert store.keys() == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert np.abs(store.image(0, 1) / 255 - expected).max() <= 0.5 / 255 + 1e-9


def test_textures_are_transparent_where_the_layer_is_missing() -> None:
    model = Ellipsoids(hole=0.15)
    grids = sample_grids(model, 32, WINDOW)
    _, _, image = next(texture_rows(model, grids))
    assert (image[~grids.valid[0]] == 0).all()
    assert (image[grids.valid[0], 3] > 0).all()


@dataclass(frozen=True)
class Broken(Ellipsoids):
    """NaN in one point, NaN in one texel."""

    def surface_points(self, uv: Tensor) -> tuple[Tensor, Tensor]:
        points, valid = super().surface_points(uv)
        points[1, 3] = torch.nan
        return points, valid

    def texture(self, uv: Tensor, layer: int, time: float) -> tuple[Tensor, Tensor]:
        rgb, alpha = super().texture(uv, layer, time)
        rgb[5] = torch.nan
        return rgb, alpha


def test_a_layer_without_any_point_and_nan_are_named() -> None:
    with pytest.raises(UserError, match="layer 0"):
        sample_grids(Ellipsoids(hole=9.0), 16, WINDOW)
    with pytest.raises(UserError, match=r"not finite[\s\S]*layer 1"):
        sample_grids(Broken(), 16, WINDOW)
    grids = sample_grids(Ellipsoids(), 16, WINDOW)
    with pytest.raises(UserError, match=r"not finite[\s\S]*layer 0, frame 0"):
        next(texture_rows(Broken(), grids))


@dataclass(frozen=True)
class Fine(Ellipsoids):
    """Of 700 x 300 texels."""

    def texel_grid(self) -> TexelGrid:  # type: ignore[override]
        return TexelGrid((-0.5, 0.5, -0.4, 0.4), (700, 300))


def test_samples_are_no_coarser_than_the_models_texels(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, upper, narrow = (-0.5, 0.5, -0.4, 0.4), (0.0, 0.5, -0.4, 0.4), (-0.32, 0.32, -0.1, 0.1)
    monkeypatch.setattr(sampling, "LEAST", 256)
    assert [samples_for(Fine(), window) for window in (whole, upper, narrow)] == [704, 384, 448]
    monkeypatch.setattr(sampling, "LEAST", 1024)
    assert samples_for(Fine(), whole) == samples_for(Ellipsoids(), whole) == 1024
