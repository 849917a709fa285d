"""The stage `subject`: whose mattes are found where, what is written, what is refused."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from facefolds_core.captures.found_scene import found_scene
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import write_frames
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.geometry.track import Track
from facefolds_core.params import SubjectParams
from facefolds_core.subject import find
from facefolds_core.subject.find import find_subject, frames_looked_at, subject_in
from facefolds_core.subject.fit import fit_pictures
from facefolds_core.subject.folder import RED, make_folder, tile
from facefolds_core.subject.found import DOUBT, belief, joined, subject_of
from facefolds_core.subject.mattes import Matte, Mattes
from facefolds_core.subject.ply import write_ply
from facefolds_core.subject.splats import MEAN, OPACITY, SCALE, TURN, Splats
from facefolds_core.subject.storage import BODY, Body, read_found, write_body, write_found
from tests.assets import TORSO
from tests.scenes import CENTRE, OPAQUE, gaussians, make_scene, render

SIZE = 24
PARAMS = SubjectParams(iterations=60, fewest=300, most=300)


@pytest.fixture
def folders(tmp_path: Path) -> SubjectFolders:
    return SubjectFolders(tmp_path / "me")


def black_plates(scene: Scene) -> None:
    """Of all cameras, as the room is black."""
    black = np.zeros((scene.height, scene.width, 3), np.uint8)
    write_frames(scene.folder / "plates.arrow", black.shape, [(c, 0, black) for c in range(len(scene.cameras))])


@pytest.fixture
def scene(folders: SubjectFolders) -> Scene:
    """With plates, and a matte of 50 of the first camera's first frame."""
    made = make_scene(folders.scene, size=SIZE)
    black_plates(made)
    write_frames(made.folder / "mattes.arrow", (SIZE, SIZE, 1), [(0, 0, np.full((SIZE, SIZE, 1), 50, np.uint8))])
    return made


def put(folder: Path, scene: Scene, value: int, shape: tuple[int, int]) -> Path:
    """A matte of the user's, of all frames of a camera."""
    folder.mkdir()
    Image.fromarray(np.full(shape, value, np.uint8)).save(folder / f"{scene.cameras[2].name}.png")
    return folder


def test_each_picture_has_a_matte_named_ones_first_then_the_captures_then_beside_plates(
    scene: Scene, folders: SubjectFolders, tmp_path: Path
) -> None:
    named = put(tmp_path / "named", scene, 150, (SIZE // 2, SIZE // 2))  # of another size
    found, told = make_folder(scene, folders.subject, PARAMS, named)
    assert Counter(one["source"] for one in told) == {"capture": 1, "named": 2, "plate": 11}
    whole = found_scene(folders)
    store = whole.open_mattes()
    assert store is not None and sorted(store) == sorted(scene.open_frames()) and len(list(store)) == 14
    assert int(store.image(0, 0)[5, 5, 0]) == 50 and int(store.image(2, 1)[5, 5, 0]) == 150
    true = render(scene.cameras[1], OPAQUE, 0)[1] > 0.5
    assert ((store.image(1, 0)[..., 0] > 127) == true).mean() > 0.96
    assert len(subject_in(whole).splats) == len(found.splats)


def test_what_is_written_can_be_looked_at_and_corrected(scene: Scene, folders: SubjectFolders) -> None:
    make_folder(scene, folders.subject, PARAMS)
    pictures = [path.relative_to(folders.subject).as_posix() for path in folders.subject.glob("*/*.png")]
    told = json.loads((folders.subject / "mattes.json").read_text())
    own = [one for one in told["pictures"] if one["source"] != "capture"]
    assert sorted(pictures) == sorted(f"{one['camera']}/{one['frame']}.png" for one in own)
    assert told["version"] == 2 and told["iou"] > 0.93 and told["start"]["gaussians"] <= 300
    assert (folders.subject / "sheet.png").is_file()


def test_mattes_of_the_training_cameras_are_enough(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", size=SIZE)
    full = np.full((SIZE, SIZE, 1), 255, np.uint8)
    keys = [(i, k) for i in scene.indices("train") for k in range(scene.num_frames)]
    write_frames(scene.folder / "mattes.arrow", (SIZE, SIZE, 1), [(*key, full) for key in keys])
    _, told = make_folder(scene, tmp_path / "subject", PARAMS)
    assert {one["camera"] for one in told} == {scene.cameras[i].name for i in scene.indices("train")}


@pytest.mark.parametrize(
    ("place", "said"), [("nowhere", "no mattes"), ("empty", "no mattes"), ("named", r"another shape[\s\S]*cam2")]
)
def test_a_folder_without_mattes_or_with_one_of_another_shape_is_refused(
    scene: Scene, folders: SubjectFolders, tmp_path: Path, place: str, said: str
) -> None:
    (tmp_path / "empty").mkdir()
    put(tmp_path / "named", scene, 0, (SIZE, SIZE // 2))
    with pytest.raises(UserError, match=said):
        make_folder(scene, folders.subject, PARAMS, tmp_path / place)
    assert not folders.subject.exists()


@pytest.mark.parametrize("empty", ["plates", "mattes"])
def test_an_empty_room_has_no_subject(tmp_path: Path, empty: str) -> None:
    scene = make_scene(tmp_path, () if empty == "plates" else OPAQUE, size=SIZE)
    if empty == "plates":
        black_plates(scene)
    else:
        clear = np.zeros((SIZE, SIZE, 1), np.uint8)
        write_frames(scene.folder / "mattes.arrow", clear.shape, [(*key, clear) for key in scene.open_frames()])
    with pytest.raises(UserError, match="no subject was found"):
        find_subject(scene, PARAMS)


def test_few_cameras_before_a_head_that_turns_look_at_several_frames(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=8, frames=9)
    assert frames_looked_at(scene) == [4]
    still = np.zeros((9, 4))
    still[:, 0] = 1
    turning = replace(scene, poses=Track(still, np.linspace(-0.1, 0.1, 27).reshape(9, 3)))
    assert frames_looked_at(turning) == [4, 0, 8]  # six cameras: four times six pictures


def test_what_floats_beside_the_subject_is_none_of_it(tmp_path: Path) -> None:
    """Neither what is solid nor what is faint; a subject may be larger than the ball."""
    scene, head = make_scene(tmp_path, size=8), gaussians(OPAQUE)
    loose = head.values[:2].copy()
    loose[:, MEAN] = [[0.3, 0.5, 0.4], [-0.1, -0.6, 0.0]]
    loose[1, OPACITY] = -1.5
    both = Splats(np.concatenate([head.values, loose]), head.background)
    np.testing.assert_array_equal(joined(both, scene), np.arange(len(both)) < len(head))
    large = head.values.copy()
    large[:, MEAN] *= 2
    large[:, SCALE] += np.log(2)
    assert joined(Splats(large, head.background), scene).all()


def test_a_doubtful_picture_has_a_red_frame_on_the_sheet(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=16)
    grey, matte = np.full((16, 16, 3), 99, np.uint8), np.full((16, 16), 255, np.uint8)

    def red(one: Matte) -> bool:
        return bool((np.abs(tile(scene, (0, 0), grey, one).astype(int) - np.array(RED)).sum(-1) < 30).any())

    assert red(Matte(matte, "gaussians", 0.3)) and not red(Matte(matte, "picture", 0.9))


def test_a_matte_is_known_without_gaussians_beside_a_plate_only(scene: Scene, tmp_path: Path) -> None:
    assert Mattes(scene).known((1, 0))
    bare = make_scene(tmp_path / "bare", size=8)
    assert not Mattes(bare).known((1, 0)) and Mattes(bare, {(1, 0): np.zeros((8, 8, 1), np.uint8)}).known((1, 0))


def test_a_torso_comes_back_with_the_gaussians(tmp_path: Path) -> None:
    found = replace(subject_in(make_scene(tmp_path, size=8, mattes=True)), torso=TORSO)
    write_found(tmp_path / "gaussians.npz", found)
    assert read_found(tmp_path / "gaussians.npz", 6).torso == TORSO


@pytest.mark.parametrize("fault", ["cut", "cameras", "infinite", "missing", "torso"])
def test_damaged_gaussians_are_refused_by_name(tmp_path: Path, fault: str) -> None:
    scene = make_scene(tmp_path, size=8, mattes=True)
    path = tmp_path / "gaussians.npz"
    found = subject_in(scene)
    if fault == "cut":
        path.write_bytes(path.read_bytes()[:1000])
    elif fault == "infinite":
        found.splats.values[3, 4] = np.inf
        write_found(path, found)
    elif fault == "torso":
        write_found(path, replace(found, torso=replace(TORSO, band=0.0)))
    elif fault == "missing":
        np.savez(path, values=found.splats.values)
    with pytest.raises(UserError, match="Gaussians are damaged") as caught:
        read_found(path, 5 if fault == "cameras" else 6)
    assert str(path) in str(caught.value)


def test_gaussians_that_poses_were_found_with_are_taken_up(tmp_path: Path) -> None:
    """Nothing is fitted to whole pictures again; where they are damaged it is said."""
    scene = make_scene(tmp_path, size=SIZE)
    splats = gaussians(OPAQUE)
    inside = np.ones(len(splats), bool)
    write_body(tmp_path / BODY, Body(splats, inside, 1))
    found, mattes = find_subject(scene, PARAMS.model_copy(update={"iterations": 8}))
    assert mattes.body is not None and mattes.body.frame == 1 and len(found.splats) == len(splats)
    np.testing.assert_array_equal(mattes.body.splats.values, splats.values)
    write_body(tmp_path / BODY, Body(splats, inside[1:], 1))
    with pytest.raises(UserError, match="Gaussians are damaged"):
        find_subject(scene, PARAMS)


def test_where_room_hung_before_the_subject_it_is_fitted_again_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, head = make_scene(tmp_path, size=SIZE), gaussians(OPAQUE, 1000)
    curtain = head.values[:1].copy()
    curtain[:, MEAN] = CENTRE + 0.62 * (scene.cameras[scene.indices("train")[0]].centre - CENTRE)
    curtain[:, SCALE], curtain[:, OPACITY] = np.log(0.07), 9
    both = Splats(np.concatenate([head.values, curtain]), head.background)
    write_body(tmp_path / BODY, Body(both, np.arange(len(both)) < len(head), 1))
    fits: list[list[np.ndarray]] = []

    def recorded(*args: Any) -> Splats:
        fits.append(args[4])
        return fit_pictures(*args)

    monkeypatch.setattr(find, "fit_pictures", recorded)
    find_subject(scene, PARAMS.model_copy(update={"iterations": 120}))
    first, again = fits
    assert first[0].mean() < 0.9 * again[0].mean()
    for one, other in zip(first[1:], again[1:], strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_splat_file_takes_the_place_of_our_own_fit(tmp_path: Path) -> None:
    """Of a scene without plates and mattes: they say where the subject is, and stay as they are."""
    scene, own = make_scene(tmp_path, size=40, frames=1), gaussians(OPAQUE)
    write_ply(tmp_path / "splats.ply", own)
    found, mattes = find_subject(scene, PARAMS, start=tmp_path / "splats.ply")
    assert 0.9 * len(own) < len(found.splats) <= len(own)
    held = scene.splits.index("holdout")
    true, here = render(scene.cameras[held], OPAQUE, 0)[1] > 0.5, mattes.of((held, 0)).opacity > 127
    assert (true & here).sum() / (true | here).sum() > 0.9


def seen_widely(folder: Path) -> tuple[Scene, np.ndarray]:
    """Whose cameras see far beyond the ball; (3, 3) directions towards them, to a side, and across both."""
    scene = make_scene(folder, size=8)
    wide = [replace(camera, K=camera.K * [[0.2, 1, 1], [1, 0.2, 1], [1, 1, 1]]) for camera in scene.cameras]
    towards = np.mean([camera.centre / np.linalg.norm(camera.centre) for camera in wide], 0)
    towards /= np.linalg.norm(towards)
    aside = np.cross(towards, [0, 1, 0])
    aside /= np.linalg.norm(aside)
    return replace(scene, cameras=wide), np.stack([towards, aside, np.cross(towards, aside)])


def small(places: np.ndarray) -> Splats:
    """Opaque Gaussians at (N, 3), 1 cm thick."""
    head = gaussians(OPAQUE)
    values = np.repeat(head.values[:1], len(places), 0)
    values[:, MEAN], values[:, SCALE], values[:, OPACITY] = places, np.log(0.01), 4
    return Splats(values, head.background)


def test_what_is_joined_to_the_subject_towards_the_cameras_is_its(tmp_path: Path) -> None:
    """As a muzzle before a wall, where the cameras' common point is; not what goes on to a side of it."""
    scene, (towards, aside, _) = seen_widely(tmp_path)
    away = np.linspace(0, 0.7, 71)
    found = subject_of(small(np.concatenate([away[:, None] * towards, away[:, None] * aside])), scene)
    assert found[:71].all() and found[71:][away < 0.44].all() and not found[71:][away > 0.46].any()


def test_a_large_gaussian_is_joined_by_all_of_its_face(tmp_path: Path) -> None:
    """As on a smooth cheek, which has few."""
    line = np.linspace(-0.1, 0.1, 21)
    splats = small(np.concatenate([line[:, None] * [1.0, 0, 0], [[0, 0.07, 0]]]))
    splats.values[-1, SCALE], splats.values[-1, TURN] = np.log([0.06, 0.05, 0.001]), (1, 0, 0, 0)
    assert subject_of(splats, seen_widely(tmp_path)[0]).all()
    splats.values[-1, SCALE] = np.log([0.06, 0.001, 0.05])
    assert not subject_of(splats, seen_widely(tmp_path)[0])[-1]


def test_a_wall_that_the_ball_cuts_off_all_around_is_doubtful_and_a_neck_is_not(tmp_path: Path) -> None:
    """A head at a wall sticks out of it; a neck and chest leave the ball at one side."""
    scene, (towards, aside, across) = seen_widely(tmp_path)
    y, z = (0.02 * values.reshape(-1, 1) for values in np.mgrid[-40:41, -40:41])
    around = np.linspace(0, 2 * np.pi, 40)[:, None]
    ring, wall, far = 0.12 * np.hstack([np.cos(around), np.sin(around)]), y * aside + z * across, np.hypot(y, z)[:, 0]
    head = np.concatenate([ring @ [aside, across] + x * towards for x in np.arange(0, 0.4, 0.02)])
    both = small(np.concatenate([wall, head]))
    sure = belief(both, scene, subject_of(both, scene))
    assert set(sure[: len(wall)][(far > 0.15) & (far < 0.4)]) == {np.float32(DOUBT)}
    assert set(sure[-40:]) == {1} and not sure[: len(wall)][far > 0.5].any()
    given = replace(scene, radius=0.45)
    assert set(belief(both, given, subject_of(both, given))) == {0, 1}
    chest = small(np.concatenate([ring @ [towards, across] + x * aside for x in np.arange(-0.7, 0.2, 0.02)]))
    sure = belief(chest, scene, subject_of(chest, scene))
    assert set(sure) == {0, 1} and set(sure[-200:]) == {1}
