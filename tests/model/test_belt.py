"""Radius maps over a chart with a belt: closed forms, compiled search against the reference, gradients, files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from facefolds_core.errors import UserError
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.torso import Torso
from facefolds_core.model import load_model, radial, save_model
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radial_kernel import SKIP, bounds, crossing_distances, heights
from facefolds_core.model.storage import ExplicitSpec, build_model
from tests.assets import TORSO
from tests.model.manifolds import bumpy, check_compiled, layered

C = (-0.25, 0.0, 0.05)
SLANTED = Chart(C, Belt(0.2, 0.3))
BROAD = (-1.2, 0.7, -1.4, 1.4)
SPEC = ExplicitSpec(centre=C, window=(-1.2, 0.7, -1.4, 1.4), nodes=(6, 7), texels=(8, 9), num_layers=2, num_frames=2)


def slanted() -> RadialManifolds:
    return bumpy(SLANTED, BROAD, 0.25, 60)


def rays_around(count: int, seed: int = 0) -> tuple[Tensor, Tensor]:
    """From all sides towards points around the axis, from above the head to below the neck."""
    generator = torch.Generator().manual_seed(seed)
    origins = torch.nn.functional.normalize(torch.randn(count, 3, generator=generator), dim=1)
    low, high = torch.tensor([-0.45, -0.2, -0.5]), torch.tensor([-0.05, 0.2, 0.25])
    targets = low + (high - low) * torch.rand(count, 3, generator=generator)
    return origins, torch.nn.functional.normalize(targets - origins, dim=1)


@pytest.mark.parametrize("search", ["crossings", "reference_crossings"])
def test_a_column_is_a_cylinder(search: str) -> None:
    """Belt at elevation 0, constant radius: a vertical wall, open behind, met from outside or from within."""
    window = (-1.2, -0.05, -1.4, 1.4)
    chart = Chart(C, Belt(0.0, 0.3))
    wall = RadialManifolds(chart, window, layered(torch.full((8, 12), 0.2), 0.02, 3))
    origins, directions = (x.double() for x in rays_around(600))
    found = getattr(wall, search)(origins, directions)
    o, d = (origins - torch.tensor(C)).numpy(), directions.numpy()
    a, b = (d[:, :2] ** 2).sum(1), (o[:, :2] * d[:, :2]).sum(1)
    met = np.zeros(2, int)
    for layer, radius in enumerate((0.22, 0.20, 0.18)):
        root = np.sqrt((b**2 - a * ((o[:, :2] ** 2).sum(1) - radius**2)).clip(0))
        expected, edge = np.zeros(len(o)), np.zeros(len(o), bool)
        for distance in ((-b + root) / a, (-b - root) / a):  # the nearer one last: it wins
            p = o + distance[:, None] * d
            u, v = 2 / np.pi * p[:, 2] / 0.3, 2 / np.pi * np.arctan2(p[:, 1], p[:, 0])
            inside = np.minimum.reduce([u - window[0], window[1] - u, v - window[2], window[3] - v])
            edge |= (np.abs(inside) < 0.03) | (root < 0.03)
            expected = np.where((inside > 0) & (root > 0), distance, expected)
        actual = (found.distance * found.hit).detach().numpy()[:, layer]
        np.testing.assert_allclose(actual[~edge], expected[~edge], atol=1e-5)
        met += [(expected[~edge] > 0).sum(), ((expected == (-b + root) / a) & ~edge & (expected > 0)).sum()]
    assert met[0] > 900 and met[1] > 100  # and some of them from within


def test_compiled_search_matches_the_reference() -> None:
    manifolds = slanted()
    found = check_compiled(manifolds, *rays_around(800), share=0.995)
    uv, radius = manifolds.chart.uv(found.points[found.hit])
    assert manifolds.chart.below(uv).float().mean() > 0.2
    assert (uv[:, 1].abs() > 1.05).float().mean() > 0.1
    rho, _ = manifolds.radii_at(uv)
    layer = found.hit.nonzero()[:, 1]
    assert (rho.gather(1, layer[:, None])[:, 0] - radius).abs().max() < 2e-5


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("chart", [Chart(C), SLANTED, Chart(C, Belt(1.0, 0.1))], ids=str)
def test_strides_through_empty_space_miss_nothing(chart: Chart, holes: bool) -> None:
    """Samples are where they are without strides: the same to the last digit."""
    window = BROAD if chart.belt is not None else (-0.8, 0.7, -1.4, 1.4)
    manifolds = bumpy(chart, window, 0.25, 60)
    rho, belt, edges = manifolds.radii().detach().numpy(), chart.numbers, np.array(window)
    if holes:
        rho[:, : rho.shape[1] // 2, -1] = np.nan
    origins, directions = (x.double().numpy() for x in rays_around(3000, seed=1))
    high, whole = heights(rho, edges, belt), rho.shape[2] - holes
    assert (high[0] < rho.min(initial=1, where=~np.isnan(rho))).mean() > 0.1
    given = origins - np.array(C), directions, rho, edges, belt, bounds(rho)
    settings = whole, manifolds.radius, radial.STEP, None
    found = [crossing_distances(*given, h, *settings) for h in (high, np.full_like(high, np.inf))]
    np.testing.assert_array_equal(*found)
    assert (found[0] > 0).any(1).mean() > 0.5


@pytest.mark.parametrize("elevation", [0.0, 0.3])
def test_strides_downwards_miss_no_ledge(elevation: float) -> None:
    """Where u falls fast with height a stride crosses much of it: rays straight down beside a thin ring of a column."""
    chart, window = Chart(C, Belt(elevation, 0.05)), (-1.9, -0.2, -1.4, 1.4)
    middle = torch.full((120, 12), 0.15)
    middle[56:64] = 0.25  # 0.009 units thick: more than a step, less than a stride
    column = RadialManifolds(chart, window, layered(middle, 0.001, 2))
    azimuth = np.linspace(-2, 2, 200)
    offsets = np.stack([0.2 * np.cos(azimuth), 0.2 * np.sin(azimuth), np.linspace(0.03, 0.06, 200)], -1)
    found = column.tracer()(offsets, np.tile([0.0, 0.0, -1.0], (200, 1)), None)
    assert (found > 0).all()


def test_a_steep_belt_on_a_thin_column() -> None:
    """Rays 80 degrees down: a stride is longer than the smallest radius."""
    chart = Chart(C, Belt(np.radians(80), 0.3))
    high = heights(np.full((8, 8, 1), 0.15, np.float32), np.array([-1.2, 0.5, -0.5, 0.5]), chart.numbers)[0]
    inside = high[48:102, 48:80]  # u from 0.5 to -1.2, v from -0.5 to 0.5
    np.testing.assert_allclose(inside, 0.15 + SKIP * chart.numbers[2], rtol=1e-6)


def test_the_ball_around_c_holds_the_column() -> None:
    manifolds = slanted()
    uv = torch.tensor([[-1.2, 0.3], [0.7, 0.0], [-0.3, 1.4], [-1.2, -1.4]])
    radii, _ = manifolds.radii_at(uv)
    far = (manifolds.chart.points(uv, radii[:, 0]) - manifolds.centre).norm(dim=-1)
    assert manifolds.radius > far.max() > manifolds.radii().max() + 0.1


@pytest.mark.parametrize(("belt", "torso"), [(None, None), (Belt(0.2, 0.3), TORSO)])
def test_a_model_keeps_its_chart_and_its_torso(tmp_path: Path, belt: Belt | None, torso: Torso | None) -> None:
    spec = SPEC.model_copy(update={"belt": belt, "torso": torso})
    save_model(build_model(spec), spec, tmp_path)
    written = json.loads((tmp_path / "model.json").read_text())
    assert ("belt" in written) == (belt is not None)  # a model without one is read by older versions
    loaded = load_model(tmp_path)
    assert (loaded.chart, loaded.torso) == (Chart(C, belt), torso)


@pytest.mark.parametrize(
    "belt",
    [
        *({"elevation": 0.2}, [0.2, 0.3], 0.2),
        *({"elevation": elevation, "girth": 0.3} for elevation in (None, 1e9, -0.1)),
        *({"elevation": 0.2, "girth": girth} for girth in (0.0, 1e300)),
    ],
)
def test_a_damaged_belt_is_named(tmp_path: Path, belt: object) -> None:
    save_model(build_model(SPEC), SPEC, tmp_path)
    description = {**json.loads((tmp_path / "model.json").read_text()), "belt": belt}
    (tmp_path / "model.json").write_text(json.dumps(description))
    with pytest.raises(UserError, match="belt"):
        load_model(tmp_path)
