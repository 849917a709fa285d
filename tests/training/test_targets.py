"""Cut-outs over changing colours: what a step is compared with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import write_frames
from facefolds_core.subject.found import reference_frame
from facefolds_core.subject.splats import MEAN, Splats
from facefolds_core.training.explicit import shading_kernel
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.teacher import MIN_START_PSNR, OTHERS, Teacher
from tests.scenes import make_scene
from tests.subject.splats import found

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


def test_the_plate_is_taken_out(scene: Scene) -> None:
    m = disc().reshape(-1, 1) / 255.0
    for cut in CutOuts(scene).cut(0):
        np.testing.assert_allclose(cut[:, :3], m * [200, 120, 60], atol=1.5)  # photo and cut-out are of 8 bits
        np.testing.assert_array_equal(cut[:, 3:], disc().reshape(-1, 1))


def test_gains_of_cameras_are_taken_out_before(scene: Scene) -> None:
    gains = np.full((len(scene.indices("train")), 3), 1.0)
    gains[1] = [1.1, 1.25, 0.9]
    plain, alike = CutOuts(scene).cut(0), CutOuts(scene, gains).cut(0)
    np.testing.assert_array_equal(alike[0], plain[0])
    inside = plain[1, :, 3] == 255
    np.testing.assert_allclose(alike[1, inside, :3], plain[1, inside, :3] / gains[1], atol=1.1)


def test_what_is_not_kept_is_cut_out_again_and_is_the_same(scene: Scene) -> None:
    kept, anew = CutOuts(scene), CutOuts(scene, kept_bytes=0)
    first = kept.cut(0), anew.cut(0)
    kept.cut(1), anew.cut(1)
    assert kept.cut(0) is first[0] and anew.cut(0) is not first[1]
    np.testing.assert_array_equal(anew.cut(0), kept.cut(0))
    anew.only = 1  # whichever is asked for
    np.testing.assert_array_equal(anew.cut(0), kept.cut(1))


def test_each_step_has_other_colours_for_each_camera(scene: Scene) -> None:
    images, random = CutOuts(scene), np.random.default_rng(0)
    images.shuffle(random)
    before = images.behind.copy()
    assert len(np.unique(before, axis=0)) == len(before) and not before[:, 3].any()
    images.shuffle(random)
    assert not np.isclose(images.behind, before)[:, :3].any()


def test_the_mean_over_all_colours_in_closed_form(scene: Scene) -> None:
    """A clear layer before a pixel that is half covered: the gradient of its alpha over many colours, and over all."""
    images, random = CutOuts(scene), np.random.default_rng(0)
    pixels = np.zeros(1, np.int32)
    codes, finer = np.full((1, 1, 2), 30000, np.uint16), np.zeros((0, 4, 1, 2), np.uint16)
    cut = np.array([[[100, 50, 20, 128]]], np.uint8)
    texture = np.full((2, 2, 1, 4), 0.25, np.float32)
    rays = codes, finer, np.full(1, -1, np.int32), pixels, pixels, np.zeros(1, np.int64), cut

    def shaded() -> tuple[float, np.ndarray]:
        gradient = np.zeros((1, 2, 2, 4), np.float32)
        rest = texture, np.zeros((0, 3), np.float32), gradient, 0.0, 0.0, False
        return shading_kernel.shade(*rays, images.behind[:1], *rest), gradient.sum((0, 1, 2))

    found = []
    for _ in range(4000):
        images.shuffle(random)
        found.append(shaded())
    images.average()
    squares, gradient = shaded()
    assert squares == pytest.approx(np.mean([one for one, _ in found]), rel=0.03)
    np.testing.assert_allclose(gradient, np.mean([of for _, of in found], 0), rtol=0.05, atol=1e-3)
    assert gradient[3] < -0.03


def test_without_plates_half_covered_pixels_get_the_colours_of_the_subject(scene: Scene) -> None:
    (scene.folder / "plates.arrow").unlink()
    cut = CutOuts(scene).cut(0)[0].astype(float)
    edge = (disc().ravel() > 80) & (disc().ravel() < 250)
    straight = 255 * cut[edge, :3] / cut[edge, 3:]
    assert np.abs(straight - [200, 120, 60]).mean() < 25


def test_virtual_cameras_come_after_the_photos_and_show_the_gaussians_of_the_frame(scene: Scene) -> None:
    teacher = Teacher(scene, found(scene, 30.0), seed=0)
    real, virtual = len(scene.indices("train")), len(teacher.virtual.cameras)
    pictures = CutOuts(scene, teacher=teacher)
    assert virtual > 0 and pictures.behind.shape == (real + virtual, 4)
    for frame in range(scene.num_frames):
        cut = pictures.cut(frame)
        np.testing.assert_array_equal(cut[:real], CutOuts(scene).cut(frame))
    shown = pictures.cut(reference_frame(scene))[real:].reshape(virtual, SIZE, SIZE, 4)
    np.testing.assert_array_equal(shown[..., 3], teacher.virtual.mattes)
    assert shown[..., 3].max() > 200
    few = CutOuts(scene, kept_bytes=0, teacher=teacher)  # not kept, they are the same again
    for frame in (1, 0, 1):
        np.testing.assert_array_equal(few.cut(frame), pictures.cut(frame))


def test_gaussians_that_explain_little_teach_nothing(scene: Scene) -> None:
    photos = CutOuts(scene).photos
    bad, good = (Teacher(scene, found(scene, psnr), seed=0) for psnr in (MIN_START_PSNR - 0.1, MIN_START_PSNR))
    assert not bad.virtual.cameras and not bad.others(photos)
    assert good.virtual.cameras and len(good.others(photos)) == min(OTHERS, scene.num_frames - 1)


@pytest.mark.parametrize("towards", [1.0, -1.0])
def test_gaussians_ride_on_a_tracked_mesh_that_the_photos_confirm(towards: float, scene: Scene) -> None:
    """The Gaussians lie beside the subject; a mesh that comes over to it in all other frames takes them along."""
    subject, aside = found(scene, 30.0), np.array([0.0, 0.1, 0.0], np.float32)
    first, mesh = reference_frame(scene), np.repeat(subject.splats.means[None] + aside, scene.num_frames, 0)
    values = subject.splats.values.copy()
    values[:, MEAN] += aside
    for frame in set(range(scene.num_frames)) - {first}:
        mesh[frame] -= towards * aside
    np.savez(scene.folder / "surface.npz", vertices=mesh, faces=np.array([[0, 1, 2]], np.int32))
    teacher = Teacher(scene, replace(subject, splats=Splats(values, subject.splats.background)), seed=0)
    teacher.others(CutOuts(scene).photos)
    assert teacher.moved(first) is None
    moved = [teacher.moved(frame) for frame in range(scene.num_frames) if frame != first]
    if towards < 0:
        assert moved == [None] * len(moved)
    for one in moved if towards > 0 else []:
        assert one is not None
        np.testing.assert_allclose(one.means, subject.splats.means, atol=1e-6)
