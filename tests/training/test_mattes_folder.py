"""data/SUBJECT/mattes: whose mattes are found, which train, which are scored by."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from facefolds_core.captures.chosen_mattes import scored_scene, training_scene
from facefolds_core.captures.part import part_of
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.frame_store import write_frames
from facefolds_core.params import ExplicitParams, MatteParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.training.mattes.find import CutOut
from facefolds_core.training.mattes.folder import Finder, make_mattes
from facefolds_core.training.photos import posed_photos
from facefolds_core.training.segments.plan import plan_take
from facefolds_core.training.volume.fit import volume_frames
from tests.scenes import make_scene

SIZE = 16


@pytest.fixture
def folders(tmp_path: Path) -> SubjectFolders:
    return SubjectFolders(tmp_path / "me")


@pytest.fixture
def scene(folders: SubjectFolders) -> Scene:
    """With a matte of 50 of the first camera's first frame, and a clean plate of its second camera."""
    made = make_scene(folders.scene, size=SIZE)
    write_frames(made.folder / "mattes.arrow", (SIZE, SIZE, 1), [(0, 0, _grey(50))])
    write_frames(made.folder / "plates.arrow", (SIZE, SIZE, 3), [(1, 0, np.zeros((SIZE, SIZE, 3), np.uint8))])
    return made


def _grey(value: int, size: int = SIZE) -> np.ndarray:
    return np.full((size, size, 1), value, np.uint8)


def _name(folder: Path, scene: Scene, camera: int, frame: int | None, value: int, shape: tuple[int, int]) -> Path:
    name = scene.cameras[camera].name
    path = folder / (f"{name}.png" if frame is None else f"{name}/{scene.frame_ids[frame]}.png")
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full(shape, value, np.uint8)).save(path)
    return folder


def _nobody(*_: Any) -> list[CutOut]:
    raise AssertionError("no picture is to be cut out")


def _make(
    scene: Scene, folders: SubjectFolders, named: Path | None = None, finder: Finder = _nobody, **params: str
) -> None:
    make_mattes(scene, folders.mattes, MatteParams.model_validate(params), ExplicitParams(), named, finder)


def _values(scene: Scene) -> dict[tuple[int, int], int]:
    store = scene.open_mattes()
    return {} if store is None else {key: int(store.image(*key)[5, 5, 0]) for key in store}


def test_where_none_is_looked_for_the_scenes_own_train_and_nothing_is_stored_twice(
    scene: Scene, folders: SubjectFolders
) -> None:
    assert _values(training_scene(folders)) == {(0, 0): 50}
    _make(scene, folders, method="none")
    assert _values(training_scene(folders)) == _values(scored_scene(folders)) == {(0, 0): 50}
    assert sorted(path.name for path in folders.mattes.iterdir()) == ["mattes.json", "sheet.png", "training"]


def test_a_scene_without_any_has_an_empty_folder(folders: SubjectFolders) -> None:
    _make(make_scene(folders.scene, size=SIZE), folders)
    assert sorted(path.name for path in folders.mattes.rglob("*")) == ["mattes.json", "training", "use.json"]
    assert _values(training_scene(folders)) == _values(scored_scene(folders)) == {}


def test_named_ones_stand_above_all_others_and_train(scene: Scene, folders: SubjectFolders, tmp_path: Path) -> None:
    named = _name(tmp_path / "named", scene, 0, 0, 200, (SIZE, SIZE))
    _name(named, scene, 2, None, 150, (SIZE // 2, SIZE // 2))  # for all frames, of another size
    _make(scene, folders, named, method="none")
    wanted = {(0, 0): 200, **{(2, k): 150 for k in range(scene.num_frames)}}
    assert _values(training_scene(folders)) == _values(scored_scene(folders)) == wanted


def test_named_ones_of_pictures_that_are_not_there_are_none(folders: SubjectFolders, tmp_path: Path) -> None:
    """A held-out camera may lack frames."""
    scene = make_scene(folders.scene, size=SIZE)
    store, lacking = scene.open_frames(), (scene.splits.index("holdout"), 1)
    rows = [(*key, store.image(*key).copy()) for key in store if key != lacking]
    del store
    write_frames(scene.folder / "frames.arrow", (SIZE, SIZE, 3), rows)
    named = _name(tmp_path / "named", scene, lacking[0], None, 150, (SIZE, SIZE))
    _make(scene, folders, named)
    assert _values(scored_scene(folders)) == {(lacking[0], 0): 150}


@pytest.mark.parametrize(("beside_plates", "train"), [(False, "all"), (True, "all"), (True, "given")])
def test_pictures_are_asked_where_nothing_else_is_known(
    scene: Scene, folders: SubjectFolders, beside_plates: bool, train: str
) -> None:
    """Of all training pictures, or of those that the starting volume is fitted to where only given mattes train; of the
    other cameras all."""
    asked: list[set[tuple[int, int]]] = []

    def found(scene: Scene, missing: Any, params: Any, bar: Any) -> list[CutOut]:
        asked.append(set(missing))
        return []

    own = [(c, k, _grey(50)) for c in (0, 3, 4) for k in range(scene.num_frames)]
    write_frames(scene.folder / "mattes.arrow", (SIZE, SIZE, 1), own)
    _make(scene, folders, finder=found, method="auto" if beside_plates else "pictures", train=train)
    assert scene.splits[3] == "holdout" and scene.num_frames == 2
    frames = (0, 1) if train == "all" else (1,)
    plate = {(1, k) for k in frames} if beside_plates else set()
    assert asked == [{(c, k) for c in (1, 2, 5, 6) for k in frames} - plate]


@pytest.mark.parametrize("frames", [1, 6])
def test_the_base_of_a_long_take_trains_with_them(folders: SubjectFolders, frames: int) -> None:
    """Its starting volume is fitted to one of the key frames, not to the frame in the middle of the take."""
    scene, black = make_scene(folders.scene, size=SIZE, frames=frames), np.zeros((SIZE, SIZE, 3), np.uint8)
    write_frames(scene.folder / "plates.arrow", black.shape, [(c, 0, black) for c in range(len(scene.cameras))])
    start = ExplicitParams.model_validate({"segments": {"joint_frames": 0, "key_frames": 2}})
    make_mattes(scene, folders.mattes, MatteParams(method="plates", train="all"), start, None, _nobody)
    trained = training_scene(folders)
    base = part_of(trained, plan_take(trained, start, 2).keys)
    seen = posed_photos(base, base.indices("train"), volume_frames(base, start))
    assert len(seen) == 6 and all(view.photo.matte is not None for view in seen)


@pytest.mark.parametrize("train", ["none", "given", "all"])
def test_which_train(scene: Scene, folders: SubjectFolders, train: str) -> None:
    _make(scene, folders, method="plates", train=train)
    assert {camera for camera, _ in _values(scored_scene(folders))} == {0, 1}
    trained = {camera for camera, _ in _values(training_scene(folders))}
    assert trained == {"none": set(), "given": {0}, "all": {0, 1}}[train]


def test_what_is_found_changes_nothing_that_training_reads(scene: Scene, folders: SubjectFolders) -> None:
    """By DVC: `train` depends on this folder."""

    def read() -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in (folders.mattes / "training").iterdir()}

    _make(scene, folders, method="none", train="given")
    before = read()
    _make(scene, folders, method="plates", train="given")
    assert read() == before


def test_each_found_one_is_a_picture_to_correct(scene: Scene, folders: SubjectFolders) -> None:
    _make(scene, folders, method="plates")
    written = [path.relative_to(folders.mattes).as_posix() for path in folders.mattes.glob("*/*.png")]
    told = json.loads((folders.mattes / "mattes.json").read_text())["pictures"]
    assert sorted(written) == sorted(f"{one['camera']}/{one['frame']}.png" for one in told)
    assert {one["source"] for one in told} == {"plate"}


@pytest.mark.parametrize("place", ["nowhere", "empty"])
def test_a_folder_without_mattes_is_refused(scene: Scene, folders: SubjectFolders, tmp_path: Path, place: str) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="no mattes"):
        _make(scene, folders, tmp_path / place)
    assert not folders.mattes.exists()


def test_a_named_one_of_another_shape_is_refused(scene: Scene, folders: SubjectFolders, tmp_path: Path) -> None:
    named = _name(tmp_path / "named", scene, 2, None, 0, (SIZE, SIZE // 2))
    with pytest.raises(UserError, match="another shape") as caught:
        _make(scene, folders, named)
    assert scene.cameras[2].name in str(caught.value)
