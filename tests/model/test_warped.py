"""Radius maps over a chart with a warp: closed form, the compiled search, texture positions, files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from facefolds_core.errors import UserError
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.sphere_uv import Window, uv_to_st
from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.model import load_model, radial, save_model
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radial_kernel import bounds, crossing_distances, texture_positions
from facefolds_core.model.storage import ExplicitSpec, build_model
from tests.model.manifolds import bumpy, check_compiled, layered
from tests.model.test_belt import rays_around
from tests.warps import ring_warp

C = (-0.25, 0.0, 0.05)
OPEN, AROUND, LOW = (-0.8, 0.7, -1.4, 1.4), (-0.9, 0.9, -2.0, 2.0), (-1.2, 0.7, -1.4, 1.4)


def warped(window: Window, belt: Belt | None = None) -> Chart:
    return Chart(C, belt, ring_warp(window))


WARPED = pytest.mark.parametrize(
    ("chart", "window"),
    [(warped(OPEN), OPEN), (warped(AROUND), AROUND), (warped(LOW, Belt(0.2, 0.3)), LOW)],
    ids=["open", "around", "belt"],
)


@pytest.mark.parametrize("search", ["crossings", "reference_crossings"])
def test_a_sphere_is_a_sphere_whatever_the_warp(search: str) -> None:
    sphere = RadialManifolds(warped(OPEN), OPEN, layered(torch.full((20, 30), 0.2), 0.0, 1))
    origins, directions = (x.double() for x in rays_around(600))
    found = getattr(sphere, search)(origins, directions)
    away = (found.points - torch.tensor(C)).norm(dim=-1)[found.hit]
    assert len(away) > 200
    np.testing.assert_allclose(away.numpy(), 0.2, atol=1e-5)


@WARPED
def test_compiled_search_matches_the_reference(chart: Chart, window: Window) -> None:
    manifolds = bumpy(chart, window, 0.25, 60)
    found = check_compiled(manifolds, *rays_around(800), share=0.99)
    uv, radius = chart.uv(found.points[found.hit])
    rho, _ = manifolds.radii_at(uv)
    layer = found.hit.nonzero()[:, 1]
    apart = (rho.gather(1, layer[:, None])[:, 0] - radius).abs()
    assert apart[uv[:, 1].abs() < 1.98].max() < 2e-5  # these maps are not alike where v's ends meet


@WARPED
def test_strides_through_empty_space_miss_nothing(chart: Chart, window: Window) -> None:
    manifolds = bumpy(chart, window, 0.25, 60)
    origins, directions = (x.double().numpy() for x in rays_around(3000, seed=1))
    offsets = origins - np.array(C)
    rho = manifolds.radii().numpy()
    none = np.full((2, 128, 128), np.inf, np.float32)
    given = offsets, directions, rho, np.array(window), chart.numbers, chart.warped, bounds(rho), none
    slow = crossing_distances(*given, rho.shape[2], manifolds.radius, radial.STEP, None)
    np.testing.assert_allclose(manifolds.tracer()(offsets, directions, None), slow, atol=2e-7, rtol=0)
    assert (slow > 0).any(1).mean() > 0.5


@WARPED
def test_texture_positions_are_where_the_chart_says(chart: Chart, window: Window) -> None:
    manifolds = bumpy(chart, window, 0.25, 60)
    origins, directions = (x.double() for x in rays_around(500))
    found = manifolds.crossings(origins, directions)
    offsets = (origins - torch.tensor(C)).numpy()
    given = offsets, directions.numpy(), found.distance.float().numpy()
    codes = texture_positions(*given, np.array(window), chart.numbers, chart.warped, None)
    uv, _ = chart.uv(found.points[found.hit].numpy())
    np.testing.assert_allclose((codes[found.hit.numpy()] - 1.0) / SCALE, uv_to_st(uv, window), atol=2e-4)


def test_a_model_keeps_its_warp_and_a_damaged_one_is_refused(tmp_path: Path) -> None:
    chart = warped(OPEN)
    assert chart.warp is not None
    shape = chart.warp.forth.shape[:2]
    common = {"centre": C, "window": OPEN, "nodes": (6, 7), "texels": (8, 9), "num_layers": 2, "num_frames": 2}
    spec = ExplicitSpec(**common, warp=shape)
    model = build_model(spec)
    assert isinstance(model.manifolds, RadialManifolds) and model.manifolds.warp is not None
    model.manifolds.warp.copy_(torch.from_numpy(np.stack([chart.warp.forth, chart.warp.back])))
    save_model(model, spec, tmp_path)
    loaded = load_model(tmp_path).chart
    assert replace(loaded, warp=None) == Chart(C) and loaded.warp is not None
    np.testing.assert_allclose(loaded.warp.forth, chart.warp.forth, atol=1e-6)
    file = tmp_path / "model.safetensors"
    tensors = load_file(file)
    tensors["manifolds.warp"][0, 3, 3] = torch.nan
    save_file(tensors, file, metadata={"spec": spec.model_dump_json()})
    with pytest.raises(UserError, match="warp"):
        load_model(tmp_path)
