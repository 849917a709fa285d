"""View effects: stored and read back, rendered by the document's formula, found again by the fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from facefolds_core.asset.cropping import CroppedLayer
from facefolds_core.asset.effects import EffectsPicture
from facefolds_core.asset.writer import LevelContent
from facefolds_core.captures.scene import read_scene
from facefolds_core.frame_store import write_frames
from facefolds_core.packaging.effects import fit_effects
from facefolds_core.rendering.effects import added_colours, to_eye
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import Hits, composite
from tests.assets import WINDOW, cap_mesh
from tests.scenes import look_at_origin, make_scene

SIZE = 48


class Grey:
    """One opaque grey layer."""

    def image(self, layer: int, frame: int, /) -> np.ndarray:
        texture = np.full((SIZE, SIZE, 4), 100, np.uint8)
        texture[..., 3] = 255
        return texture


def content() -> LevelContent:
    layer = CroppedLayer(0, cap_mesh(0.4, 20), WINDOW, (0, 0, SIZE, SIZE))
    return LevelContent([layer], Grey(), 2, 30.0)


def true_map() -> np.ndarray:
    """(6, 6, 3, 3): a smooth effect."""
    t, s = np.meshgrid(*[(np.arange(6) + 0.5) / 6] * 2, indexing="ij")
    along = np.stack([0.05 * np.sin(3 * s), 0.2 * np.cos(3 * t), 0.2 * (s - t)], -1)
    return np.asarray(along[..., None] * np.array([1.0, 0.8, 0.5]), np.float32)


def filmed(folder: Path, table: np.ndarray | None, cameras: int = 15) -> None:
    """A scene whose photos show `content` with the effects of `table`; without one, with noise for each photo."""
    make_scene(folder, cameras=cameras, size=SIZE)
    scene = read_scene(folder)
    rng = np.random.default_rng(0)
    meshes = [layer.mesh for layer in content().layers]
    rows = []
    for i, camera in enumerate(scene.cameras):
        hits = cast_layers(camera, meshes)
        added = None if table is None else added_colours(hits, to_eye(camera), [table])
        rgb, _ = composite(hits, content().frame(0), added=added)
        if table is None:
            rgb = rgb + rng.normal(0, 0.1, rgb.shape)
        pixels = np.rint(255 * np.clip(rgb, 0, 1)).astype(np.uint8)
        rows += [(i, 0, pixels), (i, 1, pixels)]
    write_frames(folder / "frames.arrow", (SIZE, SIZE, 3), rows)


def test_codes_come_back_within_half_a_step() -> None:
    rng = np.random.default_rng(0)
    maps = [rng.uniform(-0.3, 0.3, (h, w, 3, 3)).astype(np.float32) for h, w in ((7, 5), (3, 9), (1, 1))]
    picture = EffectsPicture.of(maps)
    for found, given in zip(picture.maps(), maps, strict=True):
        inside = np.abs(given) <= picture.scale
        assert np.abs(found - given)[inside].max() <= 0.51 * picture.scale / 127.5


def test_a_constant_map_adds_the_document_s_sum() -> None:
    table = np.zeros((2, 2, 3, 3), np.float32)
    table[..., 0, 0], table[..., 1, 1], table[..., 2, 2] = 0.1, 0.2, 0.3
    hits = Hits(np.ones((1, 1, 1), bool), np.full((1, 1, 1, 2), 0.3, np.float32))
    eye = np.array([[[0.6, -0.8, 0.0]]], np.float32)
    (added,) = added_colours(hits, eye, [table])
    np.testing.assert_allclose(added, [[0.06, -0.16, 0.0]], atol=1e-7)
    rgb, _ = composite(hits, [np.array([[[51, 255, 102, 255]]], np.uint8)], added=[added + np.float32([0, 0.5, 0])])
    np.testing.assert_allclose(rgb[0, 0], [0.26, 1.0, 0.4], atol=1e-6)  # green is clamped


def test_the_direction_points_to_the_eye() -> None:
    eye = to_eye(look_at_origin("front", 0, 0, 33))
    np.testing.assert_allclose(eye[16, 16], [1, 0, 0], atol=1e-6)


def test_the_fit_finds_what_was_there(tmp_path: Path) -> None:
    filmed(tmp_path, true_map())
    scene = read_scene(tmp_path)
    picture = fit_effects(content(), scene, 1e6)
    assert picture is not None
    camera = scene.cameras[scene.indices("holdout")[0]]
    hits = cast_layers(camera, [layer.mesh for layer in content().layers])
    truth = scene.open_frames().image(scene.indices("holdout")[0], 0) / 255
    errors = [
        np.abs(composite(hits, content().frame(0), added=added)[0] - truth).mean()
        for added in (None, added_colours(hits, to_eye(camera), picture.maps()))
    ]
    assert errors[1] < errors[0] / 5, errors


def test_noise_gives_no_effects(tmp_path: Path) -> None:
    filmed(tmp_path, None)
    assert fit_effects(content(), read_scene(tmp_path), 1e6) is None


def test_the_file_is_as_small_as_asked(tmp_path: Path) -> None:
    filmed(tmp_path, true_map())
    scene = read_scene(tmp_path)
    large = fit_effects(content(), scene, 1e6)
    assert large is not None
    small = fit_effects(content(), scene, len(large.png()) - 1)
    assert small is None or len(small.png()) < len(large.png())


def test_too_few_cameras_give_none(tmp_path: Path) -> None:
    filmed(tmp_path, true_map(), 3)
    assert fit_effects(content(), replace(read_scene(tmp_path), splits=("train",) * 3), 1e6) is None
