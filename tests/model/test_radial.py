"""Radius maps: closed forms, compiled search against the reference, the window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import points_to_uv, uv_to_directions
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.storage import ExplicitSpec, build_model, load_model, read_spec, save_model
from tests.model.manifolds import bumpy, check_compiled, layered

C = (-0.25, 0.0, 0.0)
WINDOW = (-0.6, 0.6, -0.6, 0.6)


def _spheres(layers: int = 3) -> RadialManifolds:
    return RadialManifolds(Chart(C), WINDOW, layered(torch.full((24, 20), 0.3), 0.03, layers))


def _bumpy() -> RadialManifolds:
    return bumpy(Chart(C), WINDOW, 0.3, 40)


def _rays(count: int, seed: int = 0) -> tuple[torch.Tensor, torch.Tensor]:
    """From around (1, 0, 0) towards points around the origin."""
    generator = torch.Generator().manual_seed(seed)
    origins = torch.tensor([1.0, 0.0, 0.0]) + 0.5 * (torch.rand(count, 3, generator=generator) - 0.5)
    targets = 0.2 * (torch.rand(count, 3, generator=generator) - 0.5)
    return origins, torch.nn.functional.normalize(targets - origins, dim=1)


def _distance(origins: torch.Tensor, directions: torch.Tensor, radius: float) -> torch.Tensor:
    """To the near side of a sphere about C; NaN beside it."""
    offset = origins - torch.tensor(C)
    b = (offset * directions).sum(1)
    return -b - (b**2 - offset.square().sum(1) + radius**2).sqrt()


@pytest.mark.parametrize("search", ["crossings", "reference_crossings"])
def test_concentric_spheres_in_closed_form(search: str) -> None:
    origins, directions = _rays(200)
    crossings = getattr(_spheres(), search)(origins, directions)
    for layer, radius in enumerate((0.33, 0.30, 0.27)):
        expected = _distance(origins, directions, radius)
        hit = crossings.hit[:, layer]
        assert hit.float().mean() > 0.9
        torch.testing.assert_close(crossings.distance[hit, layer], expected[hit], atol=3e-6, rtol=0)


def test_layers_are_nested_and_the_compiled_search_matches_the_reference() -> None:
    radii = _bumpy().radii()
    assert (radii[..., :-1] > radii[..., 1:]).all()
    check_compiled(_bumpy(), *_rays(500), share=0.998)


def test_layers_that_moved_are_met_where_they_are_now() -> None:
    manifolds, moved = _spheres(), _spheres()
    origins, directions = _rays(200)
    with torch.no_grad():
        before = manifolds.crossings(origins, directions).distance
        for one in (manifolds, moved):
            one.maps -= 0.05
        after = manifolds.crossings(origins, directions).distance
        assert torch.equal(after, moved.crossings(origins, directions).distance)
    assert (after > before + 0.01).any()


def test_there_is_no_surface_outside_the_window() -> None:
    manifolds = _spheres()
    origins, directions = _rays(500, seed=1)
    crossings = manifolds.crossings(origins, directions)
    uv, _ = points_to_uv(crossings.points[crossings.hit], manifolds.centre)
    assert uv.abs().max() <= 0.6 + 1e-4
    beside = torch.tensor([[1.0, 0.45, 0.0]])  # meets the sphere of 0.3 nowhere, passes beside it
    assert not manifolds.crossings(beside, torch.tensor([[-1.0, 0.0, 0.0]])).hit.any()


def test_one_layer_is_enough() -> None:
    manifolds = RadialManifolds(Chart(C), WINDOW, torch.full((24, 20, 1), 0.3))
    crossings = manifolds.crossings(torch.tensor([[1.0, 0.0, 0.0]]), torch.tensor([[-1.0, 0.0, 0.0]]))
    assert crossings.distance.item() == pytest.approx(0.95, abs=1e-5)
    assert np.isfinite(crossings.points.detach().numpy()).all()


def test_radii_in_a_direction_are_where_a_ray_along_it_crosses() -> None:
    torch.manual_seed(0)
    window = (-0.4, 0.5, -0.3, 0.45)
    middle = 0.3 + 0.02 * torch.rand(9, 7)
    manifolds = RadialManifolds(Chart(C), window, layered(middle, 0.01, 3))
    uv = torch.rand(200, 2) * torch.tensor([0.8, 0.7]) + torch.tensor([-0.35, -0.27])
    uv = torch.cat([uv, torch.tensor([[0.6, 0.0]])])
    radii, valid = manifolds.radii_at(uv)
    outward = uv_to_directions(uv)
    with torch.no_grad():
        found = manifolds.crossings(manifolds.centre + manifolds.radius * outward, -outward)
    assert valid[:-1].all() and not valid[-1].any()
    assert (found.hit == valid).all()
    torch.testing.assert_close(radii[:-1], (manifolds.radius - found.distance)[:-1], atol=1e-5, rtol=0)


def _two_surfaces() -> RadialManifolds:
    """Spheres, and beneath them two more in the upper half of the window only."""
    second = torch.zeros(24, 20, 2)
    second[:12] = torch.tensor([0.2, 0.19])
    return RadialManifolds(Chart(C), WINDOW, torch.cat([layered(torch.full((24, 20), 0.3), 0.03, 3), second], -1))


@pytest.mark.parametrize("search", ["crossings", "reference_crossings"])
def test_a_second_surface_is_met_where_it_is(search: str) -> None:
    manifolds = _two_surfaces()
    origins, directions = _rays(400, seed=3)
    found = getattr(manifolds, search)(origins, directions)
    assert found.hit.shape == (400, 5) and manifolds.num_layers == 5
    for layer, radius in enumerate((0.33, 0.30, 0.27, 0.2, 0.19)):
        expected = _distance(origins, directions, radius)
        u, v = points_to_uv(origins + expected[:, None] * directions, manifolds.centre)[0].unbind(1)
        there = expected.isfinite() & (u.abs() < 0.55) & (v.abs() < 0.55)
        above, below = there & (u > 0.06), there & (u < -0.03)
        assert above.sum() > 20 and below.sum() > 20
        assert found.hit[above, layer].all()
        torch.testing.assert_close(found.distance[above, layer], expected[above], atol=1e-5, rtol=0)
        assert bool(found.hit[below, layer].any()) == (layer < 3)


def test_a_second_surface_has_points_where_it_is() -> None:
    manifolds = _two_surfaces()
    radii, valid = manifolds.radii_at(torch.tensor([[0.3, 0.1], [-0.3, 0.1]]))
    assert valid.tolist() == [[True] * 5, [True] * 3 + [False] * 2]
    torch.testing.assert_close(radii[0], torch.tensor([0.33, 0.30, 0.27, 0.2, 0.19]))
    assert radii.isfinite().all()


def test_a_saved_model_keeps_its_second_surface(tmp_path: Path) -> None:
    spec = ExplicitSpec(centre=C, window=WINDOW, num_layers=5, nodes=(24, 20), texels=(8, 9), num_frames=1)
    model = build_model(spec)
    model.manifolds = _two_surfaces()
    save_model(model, spec, tmp_path)
    assert read_spec(tmp_path) == spec
    loaded = load_model(tmp_path).manifolds
    assert isinstance(loaded, RadialManifolds)
    torch.testing.assert_close(loaded.radii(), model.manifolds.radii(), rtol=0, atol=0, equal_nan=True)
