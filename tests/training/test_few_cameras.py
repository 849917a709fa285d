"""What a training of few cameras does otherwise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.frame_store import write_frames
from facefolds_core.params import ExplicitParams
from facefolds_core.training.few_cameras import for_cameras, for_scene
from tests.scenes import make_scene

PARAMS = ExplicitParams()


@pytest.mark.parametrize("plates", [True, False])
def test_the_parameters_of_many_cameras_are_left_as_they_are(plates: bool) -> None:
    assert for_cameras(PARAMS, 40, plates) == (PARAMS, ())


@pytest.mark.parametrize("plates", [True, False])
@pytest.mark.parametrize("cameras", [11, 22, 30])
def test_of_many_cameras_two_must_see_a_voxel_and_nothing_else_changes(cameras: int, plates: bool) -> None:
    found, notes = for_cameras(PARAMS, cameras, plates)
    assert found.volume.min_view_share == 2 / cameras and not notes
    volume = found.volume.model_copy(update={"min_view_share": PARAMS.volume.min_view_share})
    assert found.model_copy(update={"volume": volume}) == PARAMS
    assert for_cameras(PARAMS, cameras, plates, turns=True) == (PARAMS, ())


@pytest.mark.parametrize(("views", "cameras", "at_most"), [(8, 22, 10), (7, 20, 10), (2, 3, 0), (2, 5, 0), (6, 9, 10)])
@pytest.mark.parametrize("plates", [True, False])
def test_fog_is_thick_where_one_camera_more_sees_it(views: int, cameras: int, at_most: int, plates: bool) -> None:
    few = PARAMS.few_cameras.model_copy(update={"views": views, "at_most": at_most, "shared_views": views + 1})
    volume = for_cameras(PARAMS.model_copy(update={"few_cameras": few}), cameras, plates)[0].volume
    assert volume.min_view_share < volume.shared_view_share <= 1


@pytest.mark.parametrize("plates", [True, False])
@pytest.mark.parametrize("cameras", [3, 5, 8, 10])
def test_of_few_cameras_two_must_see_a_voxel(cameras: int, plates: bool) -> None:
    found, notes = for_cameras(PARAMS, cameras, plates)
    least = found.volume.min_view_share * cameras
    assert 1 < least <= 2 and least < found.volume.shared_view_share * cameras <= cameras
    assert [note.kind for note in notes] == ["few_cameras" if plates else "few_cameras_no_plates"]
    assert for_cameras(found, cameras, plates)[0] == found


def test_stricter_values_of_the_user_stay() -> None:
    volume = PARAMS.volume.model_copy(update={"opacity_weight": 0.02, "min_view_share": 0.5, "shared_view_share": 0.9})
    geometry = PARAMS.geometry.model_copy(update={"max_halfwidth": 0.001, "blur": 50.0})
    params = PARAMS.model_copy(update={"volume": volume, "geometry": geometry})
    found, _ = for_cameras(params, 8, plates=True)
    assert found.volume == volume and found.geometry == geometry
    params = PARAMS.model_copy(update={"textures": PARAMS.textures.model_copy(update={"pixels_per_texel": 4.0})})
    assert for_cameras(params, 8, plates=False)[0].textures == params.textures


@pytest.mark.parametrize("plates", [True, False])
def test_one_or_two_cameras_are_not_asked_for_more_than_there_are(plates: bool) -> None:
    assert for_cameras(PARAMS, 2, plates)[0] == PARAMS


def test_without_plates_opacity_costs_and_layers_lie_as_with_many_cameras() -> None:
    found, _ = for_cameras(PARAMS, 8, plates=False)
    assert found.volume.opacity_weight == PARAMS.volume.opacity_weight and found.geometry == PARAMS.geometry
    assert found.textures.pixels_per_texel > PARAMS.textures.pixels_per_texel


def test_plates_are_there_when_each_training_camera_has_one(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, cameras=6, size=8)
    plate, train = np.zeros((scene.height, scene.width, 3), np.uint8), scene.indices("train")
    without, with_plates = (for_cameras(PARAMS, len(train), plates) for plates in (False, True))
    assert for_scene(PARAMS, scene) == without != with_plates
    write_frames(scene.folder / "plates.arrow", plate.shape, [(camera, 0, plate) for camera in train[1:]])
    assert for_scene(PARAMS, scene) == without
    write_frames(scene.folder / "plates.arrow", plate.shape, [(camera, 0, plate) for camera in train])
    assert for_scene(PARAMS, scene) == with_plates


@pytest.mark.parametrize(("plates", "shares"), [(True, [1, 5 / 6, 0.625, 0.5]), (False, [1, 0.5, 0.375, 0.35])])
def test_fog_is_thinned_more_where_the_room_is_known(plates: bool, shares: list[float]) -> None:
    found = [for_cameras(PARAMS, cameras, plates)[0].volume.shared_view_share for cameras in (3, 6, 8, 10)]
    assert found == pytest.approx(shares)
