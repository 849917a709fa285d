"""The reference renderer against closed forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from facefolds_core.rendering.reference import AssetCaster, Hits, composite, opacity, sample_texture
from tests.pictures import render_asset
from tests.scenes import look_at_origin

SIZE = 16
CAMERA = look_at_origin("front", 0, 0, SIZE)
HALF = 0.35
"""Half the side of the square at x = 0 that fills the image of CAMERA."""


@dataclass(frozen=True)
class Sheet:
    vertices: np.ndarray
    faces: np.ndarray
    st: np.ndarray


@dataclass(frozen=True)
class FakeAsset:
    layers: tuple[Sheet, ...]
    textures: np.ndarray  # (K, N, R, R, 4) uint8

    def frame(self, k: int) -> np.ndarray:
        return self.textures[k]


def quad(x: float = 0.0, half: float = HALF) -> Sheet:
    """A square across the optical axis of CAMERA: s runs to the image's right (+y), t down (-z)."""
    st = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
    y, z = (2 * st[:, 0] - 1) * half, (1 - 2 * st[:, 1]) * half
    vertices = np.stack([np.full(4, x), y, z], 1).astype(np.float32)
    return Sheet(vertices, np.array([[0, 2, 1], [1, 2, 3]], np.int32), st)


def random_textures(layers: int, resolution: int = SIZE, frames: int = 1, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.integers(0, 256, (frames, layers, resolution, resolution, 4), dtype=np.uint8)


def full(layers: int, st: tuple[float, float] = (0.5, 0.5)) -> Hits:
    """One pixel that hits all layers at `st`."""
    return Hits(np.ones((1, 1, layers), bool), np.full((1, 1, layers, 2), st, np.float32))


def constant(rgba: list[tuple[int, int, int, int]]) -> np.ndarray:
    """(N, 2, 2, 4): one colour a layer."""
    return np.broadcast_to(np.array(rgba, np.uint8)[:, None, None], (len(rgba), 2, 2, 4)).copy()


def test_a_quad_that_fills_the_image_reproduces_its_texture_of_the_frame() -> None:
    textures = random_textures(1, frames=3)
    textures[..., 3] = 255
    for frame in (0, 2):
        rgb, alpha = render_asset(FakeAsset((quad(),), textures), CAMERA, frame)
        # Worst error seen 2e-7: float32 vertices and (s, t).
        np.testing.assert_allclose(rgb, textures[frame, 0, ..., :3] / 255, atol=2e-6)
        np.testing.assert_allclose(alpha, 1, atol=1e-6)


def test_a_constant_opaque_layer_has_its_colour_inside_and_nothing_outside() -> None:
    asset = FakeAsset((quad(half=HALF / 2),), constant([(10, 200, 90, 255)])[None])
    rgb, alpha = render_asset(asset, CAMERA, 0)
    inside = np.zeros((SIZE, SIZE), bool)
    inside[SIZE // 4 : -SIZE // 4, SIZE // 4 : -SIZE // 4] = True
    np.testing.assert_allclose(rgb, inside[..., None] * (np.array([10, 200, 90]) / 255), atol=1e-6)
    np.testing.assert_array_equal(alpha, inside)
    assert (rgb[~inside] == 0).all()


def test_the_nearest_of_several_sheets_of_one_layer_counts() -> None:
    """One layer made of a near and a far square: the near one hides the far one, even where it is transparent."""
    near, far = quad(0.1, 0.9 * HALF), quad(-0.1, 1.1 * HALF)
    st = np.concatenate([near.st * [0.5, 1], far.st * [0.5, 1] + [0.5, 0]]).astype(np.float32)
    faces = np.concatenate([far.faces + 4, near.faces])
    layer = Sheet(np.concatenate([near.vertices, far.vertices]), faces, st)
    hits = AssetCaster(FakeAsset((layer,), np.zeros(0))).cast(CAMERA)
    assert hits.hit.all()
    assert (hits.st[..., 0, 0] < 0.5).all()


def test_layers_are_composited_in_their_order_not_by_distance() -> None:
    """The outermost layer comes first even where it lies behind (folds of neural surfaces do cross)."""
    asset = FakeAsset((quad(-0.1, 2 * HALF), quad(0.1)), constant([(255, 0, 0, 255), (0, 255, 0, 255)])[None])
    rgb, _ = render_asset(asset, CAMERA, 0)
    np.testing.assert_array_equal(rgb, np.broadcast_to(np.float32([1, 0, 0]), rgb.shape))


@pytest.mark.parametrize(
    ("layers", "background", "colour", "covered"),
    [
        ([(255, 0, 0, 51), (0, 255, 0, 153)], (0, 0, 1), (0.2, 0.8 * 0.6, 0.8 * 0.4), 1 - 0.8 * 0.4),
        *(([(255, 255, 255, 0)] * count, (0.25, 0.5, 0.75), (0.25, 0.5, 0.75), 0) for count in (1, 12, 64)),
        ([(51, 102, 153, 255), (255, 255, 255, 255), (9, 9, 9, 100)], (1, 1, 1), (0.2, 0.4, 0.6), 1),
        ([(0, 0, 0, 5)] * 64, (0, 0, 0), (0, 0, 0), 1 - (1 - 5 / 255) ** 64),
    ],
    ids=["half transparent", "clear", "12 clear", "64 clear", "opaque", "64 thin"],
)
def test_layers_over_a_background(
    layers: list[tuple[int, int, int, int]],
    background: tuple[float, float, float],
    colour: tuple[float, float, float],
    covered: float,
) -> None:
    rgb, alpha = composite(full(len(layers)), constant(layers), background)
    np.testing.assert_allclose(rgb[0, 0], colour, atol=1e-6)
    np.testing.assert_allclose(alpha[0, 0], covered, atol=1e-6)
    assert covered not in (0, 1) or alpha[0, 0] == covered


def test_opacity_alone_is_that_of_the_picture() -> None:
    rng = np.random.default_rng(0)
    hits = Hits(rng.random((8, 8, 3)) < 0.7, rng.random((8, 8, 3, 2)).astype(np.float32))
    textures = rng.integers(0, 256, (3, 5, 7, 4), np.uint8)
    np.testing.assert_array_equal(opacity(hits, textures), composite(hits, textures)[1])


def test_missed_layers_count_for_nothing() -> None:
    hits = Hits(np.array([[[False, True]]]), np.zeros((1, 1, 2, 2), np.float32))
    rgb, alpha = composite(hits, constant([(255, 255, 255, 255), (0, 51, 0, 255)]))
    np.testing.assert_allclose(rgb[0, 0], [0, 0.2, 0], atol=1e-6)
    assert alpha[0, 0] == 1


def test_a_background_image_shows_through() -> None:
    background = np.random.default_rng(0).uniform(0, 1, (SIZE, SIZE, 3)).astype(np.float32)
    asset = FakeAsset((quad(),), constant([(0, 0, 0, 0)])[None])
    rgb, _ = render_asset(asset, CAMERA, 0, background)
    np.testing.assert_array_equal(rgb, background)


def test_a_wrong_number_of_textures_is_refused() -> None:
    with pytest.raises(ValueError, match="3 textures for 2 layers"):
        composite(full(2), constant([(0, 0, 0, 0)] * 3))


def test_texel_centres_give_the_texels_which_stay_beyond_the_edge() -> None:
    texture = random_textures(1, resolution=7)[0, 0]
    s, t = np.meshgrid((np.arange(7) + 0.5) / 7, (np.arange(7) + 0.5) / 7)
    found = sample_texture(texture, np.stack([s, t], -1).reshape(-1, 2).astype(np.float32))
    np.testing.assert_allclose(found.reshape(7, 7, 4), texture / 255, atol=2e-6)
    beyond = np.float32([[0, 0], [1, 0], [0, 1], [1, 1], [-0.5, 2.0]])
    corners = texture[[0, 0, 6, 6, 6], [0, 6, 0, 6, 0]] / 255
    np.testing.assert_allclose(sample_texture(texture, beyond), corners, atol=1e-6)


def test_between_texels_the_mean_is_taken() -> None:
    texture = np.array([[[0], [100]], [[200], [40]]], np.uint8)
    found = sample_texture(texture, np.float32([[0.5, 0.25], [0.5, 0.5]]))
    np.testing.assert_allclose(found[:, 0] * 255, [50, 85], atol=1e-4)


def test_colour_and_alpha_are_interpolated_separately() -> None:
    """As an ordinary shader does with straight alpha: the colour of a transparent texel counts."""
    texture = np.array([[[255, 0, 0, 255], [0, 0, 255, 0]]], np.uint8)
    np.testing.assert_allclose(sample_texture(texture, np.float32([[0.5, 0.5]])), [[0.5, 0, 0.5, 0.5]], atol=1e-6)
