"""What is cropped and dropped shows in no picture."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.asset.cropping import ALPHA_BOUND, crop_layers
from facefolds_core.errors import UserError
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.sphere_uv import st_to_uv
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import composite
from tests.assets import CENTRE, WINDOW, Store, cap_mesh
from tests.scenes import look_at_origin

SIZE = 48


def patches(boxes: list[tuple[int, int, int, int]], alpha: int = 200) -> np.ndarray:
    """(1, N, R, R, 4): noise that is opaque within (left, right, top, bottom) only."""
    frames = np.random.default_rng(0).integers(0, 256, (1, len(boxes), SIZE, SIZE, 4), dtype=np.uint8)
    frames[..., 3] = 0
    for layer, (left, right, top, bottom) in enumerate(boxes):
        frames[0, layer, top:bottom, left:right, 3] = alpha
    return frames


def check_same(meshes: list[TexturedMesh], frames: np.ndarray, *azimuths: float) -> None:
    """AssertionError unless pictures of the crops are those of the whole."""
    crops = crop_layers(meshes, [WINDOW] * len(meshes), Store(frames), 1)
    textures = [crop.cut(frames[0, crop.source]) for crop in crops]
    for camera in (look_at_origin("c", azimuth, 5, 64) for azimuth in azimuths):
        before = composite(cast_layers(camera, meshes), list(frames[0]))
        after = composite(cast_layers(camera, [crop.mesh for crop in crops]), textures)
        assert before[1].max() > 0.5
        for a, b in zip(before, after, strict=True):
            np.testing.assert_allclose(a, b, atol=1e-5)


def test_rendering_is_unchanged() -> None:
    frames = patches([(10, 30, 5, 12), (0, 7, 40, 48), (20, 21, 20, 21)])
    meshes = [cap_mesh(0.4 - 0.03 * i, vertices_a_side=17) for i in range(3)]
    crops = crop_layers(meshes, [WINDOW] * 3, Store(frames), 1)
    assert all(len(crop.mesh.faces) < len(meshes[0].faces) for crop in crops)
    check_same(meshes, frames, 5)


def test_no_hole_in_a_clear_front_lets_the_back_of_its_layer_through() -> None:
    """A tube: its front holds nothing, its back does, and a second layer stands within."""

    def tube(radius: float) -> TexturedMesh:
        v, z = np.meshgrid(np.linspace(-np.pi, np.pi, 33), np.linspace(-0.2, 0.2, 9))
        points = np.stack([radius * np.cos(v), radius * np.sin(v), z], -1).reshape(-1, 3).astype(np.float32)
        st = np.stack([(v / np.pi + 1) / 2, (0.2 - z) / 0.4], -1).reshape(-1, 2).astype(np.float32)
        corner = (33 * np.arange(8)[:, None] + np.arange(32)).ravel()
        faces = np.concatenate([corner[:, None] + [0, 1, 34], corner[:, None] + [0, 34, 33]]).astype(np.int32)
        return TexturedMesh(points, faces, st)

    check_same([tube(0.3), tube(0.2)], patches([(0, 6, 0, SIZE), (0, SIZE, 0, SIZE)]), -60, -20, 0, 35, 80)


def test_window_belongs_to_the_crop() -> None:
    (crop,) = crop_layers([cap_mesh(0.4)], [WINDOW], Store(patches([(10, 30, 5, 12)])), 1)
    uv = st_to_uv(crop.mesh.st.astype(np.float64), crop.window)
    offset = crop.mesh.vertices - np.array(CENTRE)
    n = offset / np.linalg.norm(offset, axis=1, keepdims=True)
    np.testing.assert_allclose(np.arcsin(n[:, 2]) * 2 / np.pi, uv[:, 0], atol=1e-5)
    np.testing.assert_allclose(np.arctan2(n[:, 1], n[:, 0]) * 2 / np.pi, uv[:, 1], atol=1e-5)


def test_a_layer_below_the_bound_goes_and_one_above_stays() -> None:
    frames = np.concatenate([patches([(0, 48, 0, 48)] * 2, alpha=ALPHA_BOUND)] * 3)
    frames[2, 1, 7, 9, 3] = ALPHA_BOUND + 1
    crops = crop_layers([cap_mesh(0.4), cap_mesh(0.37)], [WINDOW] * 2, Store(frames), 3)
    assert [crop.source for crop in crops] == [1]


def test_an_opaque_layer_stays_bit_for_bit() -> None:
    mesh = cap_mesh(0.4)
    (crop,) = crop_layers([mesh], [WINDOW], Store(patches([(0, 48, 0, 48)])), 1)
    assert crop.crop == (0, 0, SIZE, SIZE) and crop.window == WINDOW
    assert crop.mesh.st.tobytes() == mesh.st.tobytes() and crop.mesh.vertices.tobytes() == mesh.vertices.tobytes()


def test_nothing_to_show_is_said() -> None:
    with pytest.raises(UserError, match="transparent"):
        crop_layers([cap_mesh(0.4)], [WINDOW], Store(patches([(0, 0, 0, 0)])), 1)
