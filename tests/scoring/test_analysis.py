"""What layers do in pictures, and where they lie, against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.rendering import AssetCaster, Hits
from facefolds_core.rendering.intersection import EmbreeMesh
from facefolds_core.scoring.analysis import SECTION_RAYS, Sums, radii, shape_of, spacings, view_angles, weights
from tests.assets import CENTRE, cap_mesh, make_asset, radius_of
from tests.scenes import look_at_origin

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
    sums = Sums([cap_mesh(0.3)])
    angles = np.array([[5.0, 20.0, 89.0, np.nan]])
    sums.add(np.array([[1.0, 0.5, 0.5, 2.0]]), np.full((1, 4, 3), -0.1), np.ones((1, 4, 1), np.float32), angles)
    found = sums.result()
    shares = [one.share for one in found.angles]
    assert shares == pytest.approx([0.25, 0.125, 0, 0, 0, 0.125])
    assert found.bare.share == pytest.approx(0.5)
    known = [one for one in (*found.angles, found.bare) if one.share]
    assert [(one.mean, one.rms) for one in known] == [pytest.approx((0.1, 0.1))] * 4
    assert found.angles[2].rms is None


def test_contribution_is_a_share_and_the_greatest_weight_a_bound() -> None:
    sums = Sums([cap_mesh(0.3)] * 2)
    layer_weights = np.array([[[0.75, 0.25], [0.0, 0.5]]], np.float32)
    sums.add(np.ones((1, 2)), np.zeros((1, 2, 3)), layer_weights, np.zeros((1, 2)))
    found = sums.result()
    assert found.contribution == pytest.approx((0.5, 0.5))
    assert found.reach == pytest.approx((0.5, 1))
    assert found.greatest == pytest.approx((0.75, 0.5))


def test_nothing_seen_gives_no_nan() -> None:
    found = Sums([cap_mesh(0.3)] * 2).result()
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


def test_the_layers_of_an_asset(tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=3, frames=1, resolution=32)
    shape = shape_of(read_asset(tmp_path / "asset"))
    assert [gap.mean for gap in shape.spacing] == pytest.approx([0.03, 0.03], rel=0.02)
    for cut in shape.sections.values():
        assert cut.shape == (3, SECTION_RAYS, 2)
    side = shape.sections["from the side"][0] - [CENTRE[0], CENTRE[2]]
    known = side[np.isfinite(side[:, 0])]
    assert len(known) > SECTION_RAYS / 2
    np.testing.assert_allclose(np.linalg.norm(known, axis=-1), radius_of(0), rtol=0.01)
