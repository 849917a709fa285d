"""Cut-outs over changing colours: what a step is compared with where the subject's opacity is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.frame_store import write_frames
from facefolds_core.training.explicit.targets import CutOuts, all_mattes, put_over
from facefolds_core.training.explicit.views import Images
from tests.scenes import make_scene

SIZE = 24


def disc() -> NDArray[np.uint8]:
    """(SIZE, SIZE, 1) with a soft edge."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    return np.rint(255 * np.clip(8 - np.hypot(x, y), 0, 1)).astype(np.uint8)[..., None]


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """Subject of one colour before plates of noise, with mattes of all training pictures."""
    made = make_scene(tmp_path / "scene", size=SIZE)
    cameras, frames = range(len(made.cameras)), range(made.num_frames)
    rng = np.random.default_rng(0)
    plates = rng.integers(0, 256, (len(made.cameras), SIZE, SIZE, 3), dtype=np.uint8)
    m = disc() / 255.0
    photos = np.rint(m * np.array([200.0, 120.0, 60.0]) + (1 - m) * plates).astype(np.uint8)
    store = tmp_path / "scene"
    write_frames(store / "frames.arrow", (SIZE, SIZE, 3), ((c, k, photos[c]) for c in cameras for k in frames))
    write_frames(store / "plates.arrow", (SIZE, SIZE, 3), ((c, 0, plates[c]) for c in cameras))
    write_frames(tmp_path / "mattes.arrow", (SIZE, SIZE, 1), ((c, k, disc()) for c in cameras for k in frames))
    return replace(made, mattes=tmp_path / "mattes.arrow")


def test_the_plate_is_taken_out_and_any_colour_put_in(scene: Scene) -> None:
    images = CutOuts(scene)
    images.shuffle(np.random.default_rng(1))
    m = disc().reshape(-1, 1) / 255.0
    found = images.frame(0)
    for picture, behind in zip(found, images.behind, strict=True):
        expected = m * [200, 120, 60] + (1 - m) * 255 * behind
        np.testing.assert_allclose(picture, expected, atol=2.5)  # photo, cut-out and picture are each of 8 bits


def test_each_step_has_other_colours_for_each_camera(scene: Scene) -> None:
    images, random = CutOuts(scene), np.random.default_rng(0)
    images.shuffle(random)
    before = images.behind.copy()
    assert len(np.unique(before, axis=0)) == len(before)
    images.shuffle(random)
    assert not np.isclose(images.behind, before).any()


def test_without_plates_half_covered_pixels_get_the_colours_of_the_subject(scene: Scene) -> None:
    (scene.folder / "plates.arrow").unlink()
    cut = CutOuts(scene).cut(0)[0].astype(float)
    edge = (disc().ravel() > 80) & (disc().ravel() < 250)
    straight = 255 * cut[edge, :3] / cut[edge, 3:]
    assert np.abs(straight - [200, 120, 60]).mean() < 25


def test_pictures_of_a_subject_that_is_not_known_everywhere_stay_photos(scene: Scene, tmp_path: Path) -> None:
    assert all_mattes(scene)
    assert not all_mattes(replace(scene, mattes=tmp_path / "none.arrow"))
    last = scene.indices("train")[-1]
    rest = [key for key in scene.open_frames() if key != (last, 0)]
    write_frames(tmp_path / "some.arrow", (SIZE, SIZE, 1), ((*key, disc()) for key in rest))
    assert not all_mattes(replace(scene, mattes=tmp_path / "some.arrow"))
    assert not Images(scene).changes


def test_compositing_is_what_the_formula_says() -> None:
    rng = np.random.default_rng(0)
    alpha = rng.integers(0, 256, (2, 50, 1), dtype=np.uint8)
    cut = np.concatenate([(rng.random((2, 50, 3)) * alpha).astype(np.uint8), alpha], -1)
    behind, out = rng.random((2, 3), np.float32), np.empty((2, 50, 3), np.uint8)
    put_over(cut, behind, out)
    expected = cut[..., :3] + (255.0 - cut[..., 3:]) * behind[:, None]
    assert np.abs(out - expected).max() <= 0.51
