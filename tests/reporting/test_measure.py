"""What the report measures by itself, against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.rendering import AssetCaster, Hits, composite
from facefolds_core.rendering.intersection import EmbreeMesh
from facefolds_core.reporting.build import MOST_PIXELS, chosen_pairs
from facefolds_core.reporting.measure import Sums, measure, radii, spacings, view_angles, weights
from facefolds_core.reporting.tables import place_of
from facefolds_core.scoring.metrics import shown
from tests.assets import CENTRE, cap_mesh, make_asset, radius_of
from tests.scenes import look_at_origin, make_scene

ALONG_X = np.array([[1.0, 0.0, 0.0]])


def test_weights_are_what_the_layers_before_let_through() -> None:
    half = np.full((4, 4, 4), 128, np.uint8)
    hits = Hits(np.ones((2, 3, 3), bool), np.full((2, 3, 3, 2), 0.5, np.float32))
    alpha = 128 / 255
    expected = [alpha, alpha * (1 - alpha), alpha * (1 - alpha) ** 2]
    np.testing.assert_allclose(weights(hits, [half] * 3), np.broadcast_to(expected, (2, 3, 3)), rtol=1e-6)


def test_a_layer_that_is_not_hit_has_no_weight() -> None:
    hits = Hits(np.zeros((1, 1, 2), bool), np.zeros((1, 1, 2, 2), np.float32))
    assert not weights(hits, [np.full((2, 2, 4), 255, np.uint8)] * 2).any()


def test_the_angle_on_a_sphere_is_the_arc_sine_of_the_rays_distance() -> None:
    radius, camera = 0.35, look_at_origin("front", 10, 5, 24)
    mesh = cap_mesh(radius, vertices_a_side=120)
    hit = AssetCaster(_Caps([mesh])).cast(camera).hit[..., :1]
    angles = view_angles(camera, [EmbreeMesh(mesh.vertices, mesh.faces)], hit.astype(np.float32))
    origins, directions = camera.rays()
    distance = np.linalg.norm(np.cross(np.array(CENTRE) - origins, directions), axis=-1)
    assert (np.isnan(angles) == ~hit[..., 0]).all()
    expected = np.degrees(np.arcsin(distance[hit[..., 0]] / radius))
    # Triangles of 0.6 degrees: their normals differ from the sphere's by up to half of their diagonal.
    np.testing.assert_allclose(angles[hit[..., 0]], expected, atol=0.6)


class _Caps:
    """Meshes as `AssetCaster` takes them."""

    def __init__(self, layers: list) -> None:
        self.layers = layers

    def frame(self, k: int, /) -> list:
        raise NotImplementedError


def test_an_even_error_is_the_same_at_all_angles_and_the_shares_add_up() -> None:
    sums = Sums(1)
    angles = np.array([[5.0, 20.0, 89.0, np.nan]])
    sums.add(np.array([[1.0, 0.5, 0.5, 2.0]]), np.full((1, 4, 3), -0.1), np.ones((1, 4, 1), np.float32), angles)
    found = sums.result([])
    shares = [one.share for one in found.angles]
    assert shares == pytest.approx([0.25, 0.125, 0, 0, 0, 0.125])
    assert found.bare.share == pytest.approx(0.5)
    known = [one for one in (*found.angles, found.bare) if one.share]
    assert [(one.mean, one.rms) for one in known] == [pytest.approx((0.1, 0.1))] * 4
    assert found.angles[2].rms is None


def test_contribution_is_a_share_and_the_greatest_weight_a_bound() -> None:
    sums = Sums(2)
    layer_weights = np.array([[[0.75, 0.25], [0.0, 0.5]]], np.float32)
    sums.add(np.ones((1, 2)), np.zeros((1, 2, 3)), layer_weights, np.zeros((1, 2)))
    found = sums.result([])
    assert found.contribution == pytest.approx((0.5, 0.5))
    assert found.reach == pytest.approx((0.5, 1))
    assert found.greatest == pytest.approx((0.75, 0.5))


def test_nothing_seen_gives_no_nan() -> None:
    found = Sums(2).result([])
    assert found.contribution == (0, 0)
    assert found.bare.rms is None


def test_the_spacing_of_nested_spheres() -> None:
    layers = [cap_mesh(radius_of(layer), vertices_a_side=40) for layer in range(3)]
    found = spacings(radii(layers, np.array(CENTRE), ALONG_X))
    assert [gap.mean for gap in found] == pytest.approx([0.03, 0.03], rel=1e-2)
    assert found[0].least == found[0].mean


def test_layers_that_cross_have_a_negative_spacing() -> None:
    found = spacings(radii([cap_mesh(0.3), cap_mesh(0.4)], np.array(CENTRE), ALONG_X))
    assert found[0].least == pytest.approx(-0.1, rel=0.02)


def test_layers_that_no_ray_meets_together_have_no_spacing() -> None:
    found = spacings(radii([cap_mesh(0.3), cap_mesh(0.4)], np.array(CENTRE), np.array([[-1.0, 0.0, 0.0]])))
    assert (found[0].mean, found[0].least) == (None, None)


def test_the_place_of_a_camera() -> None:
    found = place_of(look_at_origin("left", 30, 20, 8))
    expected = np.degrees(np.arccos(np.cos(np.radians(30)) * np.cos(np.radians(20))))
    assert (found.azimuth, found.elevation, found.angle) == pytest.approx((30, 20, expected))


def test_measured_of_an_asset(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", frames=3)
    make_asset(tmp_path / "asset", layers=2, frames=3, resolution=32)
    asset = read_asset(tmp_path / "asset")
    found = measure(scene, asset, [(3, 0), (3, 2)], (0, 0, 0))
    assert [(view.camera, view.frame) for view in found.views] == [("cam3", "000000"), ("cam3", "000002")]
    assert found.masked
    assert sum(found.contribution) == pytest.approx(1)
    assert sum(one.share for one in found.angles) + found.bare.share == pytest.approx(1)


def test_of_frames_between_frames_the_captures_own_are_measured(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", frames=3)
    make_asset(tmp_path / "asset", layers=2, frames=6, resolution=32)
    asset = read_asset(tmp_path / "asset")
    view = measure(scene, asset, [(3, 2)], (0, 0, 0)).views[0]
    rgb, _ = composite(AssetCaster(asset).cast(scene.cameras[3]), asset.frame(4))
    np.testing.assert_array_equal(view.asset, shown(rgb))


def test_large_pictures_are_fewer(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, frames=4)
    assert chosen_pairs(scene, 3) == [(3, 0), (3, 2), (3, 3)]
    assert chosen_pairs(scene, 3, 2 * scene.width * scene.height) == [(3, 0), (3, 3)]
    assert MOST_PIXELS > 768 * 500
