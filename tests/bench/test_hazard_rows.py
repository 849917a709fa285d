"""Each hazard does what it says, on a tiny scene."""

from pathlib import Path

import numpy as np
import pytest

from bench import hazard_rows as hazards
from bench.hazard_film import Film, Shots, of_split, read_shots, write_shots
from bench.hazard_rows import HAZARDS, Hazard
from facefolds_core.captures.scene import SPHERE_CENTRE
from tests.scenes import OPAQUE, make_scene


def random() -> np.random.Generator:
    return np.random.default_rng(5)


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Shots:
    folder = tmp_path_factory.mktemp("shots") / "scene"
    make_scene(folder, OPAQUE, cameras=7, size=16, frames=4, surface_radius=0.33)
    return read_shots(folder)


def test_shots_survive_the_disk(shots: Shots, tmp_path: Path) -> None:
    write_shots(shots, tmp_path / "again")
    again = read_shots(tmp_path / "again")
    assert again.images.keys() == shots.images.keys() and again.masks.keys() == shots.masks.keys()
    assert all(np.array_equal(again.images[key], image) for key, image in shots.images.items())
    assert again.surface is not None and shots.surface is not None
    assert np.array_equal(again.surface[0], shots.surface[0])


def test_training_and_held_out_cameras_part(shots: Shots) -> None:
    part = of_split(shots, "train")
    names = [c.name for c in part.scene.cameras]
    assert names == ["cam0", "cam1", "cam2", "cam4", "cam5", "cam6"] and not part.masks
    assert np.array_equal(part.images[3, 1], shots.images[4, 1])


def test_fewer_cameras_reach_from_side_to_side(shots: Shots) -> None:
    kept = hazards.fewer_cameras(shots, 3, random())
    assert [c.name for c in kept.scene.cameras] == ["cam0", "cam3", "cam6"]
    assert np.array_equal(kept.images[2, 0], shots.images[6, 0])


def off(moved: Shots, shots: Shots) -> np.ndarray:
    """(7, 2) pixels that cameras see the origin elsewhere."""
    seen = [[c.project(np.zeros((1, 3)))[0][0] for c in one.scene.cameras] for one in (moved, shots)]
    return np.subtract(*seen)


def test_calibration_noise_is_of_so_many_pixels(shots: Shots) -> None:
    moved = hazards.calibration_noise(shots, 0.5, random())
    # The same deviates as the hazard draws; turning by an angle moves the middle by f tan(angle).
    assert off(moved, shots) == pytest.approx(random().normal(0, 0.5, (7, 2)), abs=0.02)
    centres = [(a.centre, b.centre) for a, b in zip(shots.scene.cameras, moved.scene.cameras, strict=True)]
    assert all(a == pytest.approx(b) for a, b in centres)


def test_one_camera_off_is_one(shots: Shots) -> None:
    apart = sorted(np.linalg.norm(off(hazards.one_camera_off(shots, 4, random()), shots), axis=1))
    assert apart[:-1] == pytest.approx([0] * 6, abs=1e-9) and apart[-1] == pytest.approx(4, rel=0.1)


def test_exposure_multiplies_light() -> None:
    grey = np.full((1, 1, 3), 128, np.uint8)
    assert np.array_equal(hazards.exposed(grey, np.ones(3)), grey)
    # sRGB 128 is 0.2159 of linear light; twice that is 0.4317, which is 175.5 again.
    assert hazards.exposed(grey, np.array([2.0, 1.0, 0.5]))[0, 0].tolist() == pytest.approx([175, 128, 92], abs=1)
    assert hazards.exposed(grey, np.full(3, 100.0)).max() == 255


def test_exposures_differ_and_have_the_mean_one(shots: Shots) -> None:
    grey = {key: np.full((4, 4, 3), 100, np.uint8) for key in shots.images}
    moved = hazards.exposure(Shots(shots.scene, grey, {}, None), 0.3, random())
    stops = 2.2 * np.log2([moved.images[c, 0].mean() / 100 for c in range(7)])
    assert abs(stops.mean()) < 0.05 and 0.1 < stops.std() < 0.6
    assert np.array_equal(moved.images[2, 0], moved.images[2, 3])


def test_missing_frames_keep_the_times_of_the_others(shots: Shots) -> None:
    left = hazards.missing_frames(shots, 2, random())
    assert left.scene.num_frames == 2 and left.scene.times[0] == 0
    kept = [shots.scene.frame_ids.index(name) for name in left.scene.frame_ids]
    assert left.scene.times.tolist() == shots.scene.times[kept].tolist()
    assert np.array_equal(left.images[3, 1], shots.images[3, kept[1]])
    assert left.surface is not None and left.surface[0].shape[0] == 2


@pytest.mark.parametrize("hazard", [hazards.wrong_centre, hazards.wrong_scale])
def test_a_moved_world_shows_the_same(shots: Shots, hazard: hazards.Disturb) -> None:
    moved = hazard(shots, 1.25, random())
    assert shots.surface is not None and moved.surface is not None
    before, after = shots.surface[0][0].astype(float), moved.surface[0][0].astype(float)
    assert np.linalg.norm(after - before, axis=1).max() > 0.05
    for old, new in zip(shots.scene.cameras, moved.scene.cameras, strict=True):
        assert new.project(after)[0] == pytest.approx(old.project(before)[0], abs=1e-3)


def test_a_wrong_radius_is_the_mesh_alone(shots: Shots) -> None:
    moved = hazards.wrong_radius(shots, 0.8, random())
    assert moved.surface is not None and moved.scene is shots.scene
    assert np.linalg.norm(moved.surface[0] - np.array(SPHERE_CENTRE), axis=-1) == pytest.approx(0.8 * 0.33, abs=1e-5)


@pytest.mark.parametrize("hazard", HAZARDS, ids=lambda hazard: hazard.key)
def test_the_truth_is_never_disturbed(hazard: Hazard) -> None:
    film = hazard.truth(hazard.strengths[2]) if hazard.truth else Film()
    assert film.options.shutter == 0 and (film.height, film.width) == (Film().height, Film().width)
