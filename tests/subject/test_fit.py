"""A textured half ball before a patterned wall: Gaussians, the subject, mattes, what stands behind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.quaternions import rotation
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track
from facefolds_core.subject import mattes as mattes_module
from facefolds_core.subject.body import body_among
from facefolds_core.subject.cut_out import agreement
from facefolds_core.subject.drawing import render
from facefolds_core.subject.find import fit_room, pictures_of
from facefolds_core.subject.fit import fit_pictures
from facefolds_core.subject.foreign import moved, read_start
from facefolds_core.subject.found import background, near_enough, subject_of
from facefolds_core.subject.gaussians import GaussianMethod
from facefolds_core.subject.hull import contradicted, looks_like
from facefolds_core.subject.mattes import Mattes
from facefolds_core.subject.ply import write_ply
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, TURN, Splats
from facefolds_core.subject.storage import Body
from facefolds_core.subject.sweep import depth_maps
from tests.geometry.test_track import about
from tests.scenes import OPAQUE, first_hit, look_at_origin
from tests.scenes import render as true_picture

SIZE, CAMERAS, HELD = 48, 8, 3
PARAMS = GaussianMethod(fewest=1200, most=1200, iterations=800, every=50)


def wall(camera):  # type: ignore[no-untyped-def]
    """(H, W, 3) of a wall at x = -1, in soft tiles."""
    origins, directions = camera.rays()
    points = origins + ((-1 - origins[..., :1]) / directions[..., :1]) * directions
    wave = np.sin(9 * points[..., 1:2]) * np.sin(9 * points[..., 2:3])
    return 0.5 + 0.4 * wave * np.array([1.0, -0.5, 0.3])


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    folder = tmp_path_factory.mktemp("scene")
    azimuths = np.linspace(-40, 40, CAMERAS)
    rig = tuple(look_at_origin(f"c{i}", azimuth, 12 * (-1) ** i, SIZE) for i, azimuth in enumerate(azimuths))
    scene = Scene(
        "ball", rig, tuple("holdout" if i == HELD else "train" for i in range(CAMERAS)), ("0",), np.zeros(1), 0.0,
        Similarity(2.0, rotation(np.array([0.8, 0.0, 0.6, 0.0])), np.array([0.1, 0.2, 0.3])), (), folder,
    )  # fmt: skip
    pictures, masks = [], []
    for camera in rig:
        rgb, alpha = true_picture(camera, OPAQUE, 0)
        pictures.append(np.round(255 * (rgb + (1 - alpha[..., None]) * wall(camera))).astype(np.uint8))
        masks.append(np.round(255 * alpha[..., None]).astype(np.uint8))
    write_frames(folder / "frames.arrow", (SIZE, SIZE, 3), ((i, 0, one) for i, one in enumerate(pictures)))
    write_frames(folder / "masks.arrow", (SIZE, SIZE, 1), [(HELD, 0, masks[HELD])])
    write_scene(scene, folder)
    return scene


@pytest.fixture(scope="module")
def splats(scene: Scene) -> Splats:
    return fit_room(scene, 0, PARAMS)


def silhouette(scene: Scene) -> np.ndarray:
    masks = scene.open_masks()
    assert masks is not None
    return masks.image(HELD, 0)[..., 0] > 127


def psnr(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(-10 * np.log10(((np.clip(picture, 0, 1) - truth / 255) ** 2).mean()))


def test_depths_are_found(scene: Scene) -> None:
    cameras, pictures = pictures_of(scene, 0, range(CAMERAS))
    small, _, depths, agree = depth_maps(cameras, pictures, 0.25)
    origins, directions = small[0].rays()
    distance, hit = first_hit(origins, directions, OPAQUE[0].radius)
    sure = hit & (agree[0] >= 3)
    assert sure.sum() > 0.4 * hit.sum()
    error = depths[0] - distance * (directions @ small[0].forward)
    assert np.median(np.abs(error[sure])) < 0.02


def test_a_view_that_was_left_out(scene: Scene, splats: Splats) -> None:
    store = scene.open_frames()
    assert len(splats) <= PARAMS.most
    assert psnr(render(splats, scene.cameras[0])[0], store.image(0, 0)) > 22
    rgb, alpha, depth = render(splats, scene.cameras[HELD])
    assert psnr(rgb, store.image(HELD, 0)) > 17
    middle = (slice(SIZE // 2 - 3, SIZE // 2 + 3),) * 2
    distance, _ = first_hit(*scene.cameras[HELD].rays(), OPAQUE[0].radius)
    assert np.abs(depth - distance)[middle].mean() < 0.25  # a little of the wall shines through
    assert alpha[middle].min() > 0.8


def test_the_same_again(scene: Scene) -> None:
    few = GaussianMethod(fewest=200, most=200, iterations=12, every=4)
    cameras, pictures = pictures_of(scene, 0, scene.indices("train"))
    one, two = (fit_pictures(cameras, pictures, few, seed=3) for _ in range(2))
    np.testing.assert_array_equal(one.values, two.values)


def test_subject_mattes_and_what_stands_behind(scene: Scene, splats: Splats) -> None:
    subject = subject_of(splats, scene)
    assert 0.1 < subject.mean() < 0.95
    body = body_among(scene, splats, 0)
    assert (body.subject <= (np.linalg.norm(splats.means, axis=1) < 0.45)).all()
    true = silhouette(scene)
    found = Mattes(scene, body=body).of((HELD, 0))
    assert found.source == "picture" and found.agreement is not None and found.agreement > 0.7
    assert agreement(found.opacity > 127, true) > 0.9
    behind = background(splats, subject, scene.cameras[HELD])
    assert np.abs(behind - wall(scene.cameras[HELD]))[~true].mean() < 0.12


def test_what_hangs_behind_the_subject_and_is_hidden_by_it_is_none_of_it(scene: Scene, splats: Splats) -> None:
    """No picture shows it, so none votes against it; it is not connected."""
    hidden = splats.values[:20].copy()
    hidden[:, MEAN], hidden[:, SCALE], hidden[:, OPACITY] = (-0.42, 0, 0), np.log(0.01), 4
    added = Splats(np.concatenate([splats.values, hidden]), splats.background)
    assert near_enough(added, scene)[-20:].all()
    assert not body_among(scene, added, 0).subject[-20:].any()


def test_what_hangs_before_a_plain_wall_in_its_colour_is_none_of_the_subject(tmp_path: Path) -> None:
    """Every picture looks the same without it. What differs from the wall stays, and what touches it in pictures."""
    rig = tuple(look_at_origin(f"c{i}", azimuth, 0, 96) for i, azimuth in enumerate((-30, -10, 10, 30)))
    random = np.random.default_rng(0)
    wall, head, beside = random.uniform(-1.5, 1.5, (900, 3)), random.normal(0, 0.06, (300, 3)), np.zeros((12, 3))
    wall[:, 0], beside[:, 1] = -1, np.linspace(0.15, 0.37, 12)
    values = np.zeros((1212, COLUMNS), np.float32)
    values[:, MEAN] = np.concatenate([wall, head, beside])
    values[:, SCALE] = np.log(np.repeat([0.08, 0.03, 0.05], [900, 300, 12]))[:, None]
    values[:, TURN.start], values[:, OPACITY] = 1, 4
    values[:, COLOUR] = np.repeat([[0.7, 0.7, 0.7], [0.6, 0.2, 0.1], [0.7, 0.7, 0.7]], [900, 300, 12], 0)
    splats, true = Splats(values, np.full(3, 0.7, np.float32)), Splats(values[:1200], np.full(3, 0.7, np.float32))
    scene = Scene(
        "s", rig, ("train",) * 4, ("0",), np.zeros(1), 0.0, Similarity(1, np.eye(3), np.zeros(3)), (), tmp_path
    )
    pictures = (np.rint(255 * np.clip(render(true, camera)[0], 0, 1)).astype(np.uint8) for camera in rig)
    write_frames(tmp_path / "frames.arrow", (96, 96, 3), ((i, 0, one) for i, one in enumerate(pictures)))
    assert subject_of(splats, scene)[-12:].all()
    body = body_among(scene, splats, 0).subject
    assert body[900:1200].mean() > 0.9
    assert not body[-6:].any()


@pytest.mark.parametrize(
    ("share", "frame", "source"),
    [(0.7, 0, "gaussians"), (0.85, 0, "picture"), (0.7, 1, "picture"), (0.6, 1, "gaussians")],
)
def test_a_picture_that_contradicts_the_others_is_not_believed(
    scene: Scene, splats: Splats, monkeypatch: pytest.MonkeyPatch, share: float, frame: int, source: str
) -> None:
    """What the Gaussians show takes its place: in their own frame sooner, since they show that very moment."""
    monkeypatch.setattr(mattes_module, "agreement", lambda cut, other: share)
    found = Mattes(scene, body=Body(splats, subject_of(splats, scene), frame)).of((HELD, 0))
    assert (found.source, found.agreement) == (source, share)


def test_a_picture_that_contradicts_the_first_fit_is_asked_of_the_subject_alone(
    scene: Scene, splats: Splats, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mattes_module, "ASKED", 1.01)  # none agrees
    true = silhouette(scene)
    mattes = Mattes(scene, body=body_among(scene, splats, 0))
    before, (colours, opacities) = mattes.of((HELD, 0)), cut_outs(scene)
    mattes.alone = fit_pictures(scene.cameras, colours, PARAMS, 0, opacities)
    found = mattes.of((HELD, 0))
    assert before.source == found.source == "gaussians"
    assert agreement(before.opacity > 127, true) < agreement(found.opacity > 127, true) > 0.93


def test_mattes_of_many_pictures_at_once_are_those_of_one_after_the_other(scene: Scene, splats: Splats) -> None:
    body, keys = body_among(scene, splats, 0), sorted(scene.open_frames())
    single, many = Mattes(scene, body=body), Mattes(scene, body=body)
    single.alone = many.alone = splats.part(body.subject)
    found = list(many.each(keys))
    assert [key for key, _ in found] == keys
    for key, matte in found:
        expected = single.of(key)
        assert (matte.source, matte.agreement) == (expected.source, expected.agreement)
        np.testing.assert_array_equal(matte.opacity, expected.opacity)


def cut_outs(scene: Scene) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Of all cameras, colours times opacity and opacity."""
    pairs = [true_picture(camera, OPAQUE, 0) for camera in scene.cameras]
    return [rgb.astype(np.float32) for rgb, _ in pairs], [alpha.astype(np.float32) for _, alpha in pairs]


def test_of_a_subject_that_is_cut_out_nothing_else_is_explained(scene: Scene) -> None:
    colours, opacities = cut_outs(scene)
    seen, shown, covered = ([*all_of[:HELD], *all_of[HELD + 1 :]] for all_of in (scene.cameras, colours, opacities))
    found = fit_pictures(seen, shown, PARAMS, 0, covered)
    assert not found.background.any()
    rgb, alpha, _ = render(found, scene.cameras[HELD])
    assert np.abs(alpha - opacities[HELD]).mean() < 0.05
    assert psnr(rgb, 255 * colours[HELD]) > 20
    few = fit_pictures(scene.cameras, colours, PARAMS, 0, opacities, begun=found)  # trained on, and no more of them
    assert len(few) <= len(found) and psnr(render(few, scene.cameras[HELD])[0], 255 * colours[HELD]) > 21


def test_a_hole_in_one_silhouette_is_none_where_all_others_contradict_it(scene: Scene) -> None:
    """Hair before a shelf of its colour: to one camera it looks like the plate."""
    colours, opacities = cut_outs(scene)
    silhouettes = [opacity > 0.5 for opacity in opacities]
    true, wrong = silhouettes[HELD].copy(), 4
    middle = SIZE // 2
    hole = np.s_[middle - wrong : middle + wrong, middle - wrong : middle + wrong]
    picture = np.dstack([colours[HELD], np.ones((SIZE, SIZE))]).astype(np.float32)
    colours[HELD][hole], opacities[HELD][hole], silhouettes[HELD][hole] = 0, 0, False
    against = contradicted(scene.cameras, silhouettes, 0.5)
    assert true[hole].all() and against[HELD][hole].all()
    assert not (against[HELD] & silhouettes[HELD]).any() and not against[HELD][:4].any()
    doubtful: list[np.ndarray | None] = [None] * CAMERAS
    believing = fit_pictures(scene.cameras, colours, PARAMS, 0, opacities)
    doubtful[HELD] = picture * against[HELD][..., None]
    doubting = fit_pictures(scene.cameras, colours, PARAMS, 0, opacities, None, doubtful)
    one, two = (render(splats, scene.cameras[HELD])[1][hole].mean() for splats in (believing, doubting))
    assert 1 - two < 0.7 * (1 - one)  # seen: 0.045 of 0.091


def test_a_board_of_hairs_colour_looks_like_the_hair_before_it_but_a_book_does_not() -> None:
    random, opacity = np.random.default_rng(0), np.zeros((40, 60), np.float32)
    opacity[:, :30] = 1
    picture = np.full((40, 60, 3), (0.1, 0.2, 0.7), np.float32)
    picture[:, :30] = picture[20:, 30:] = (0.25, 0.2, 0.15)
    picture += random.normal(0, 0.01, picture.shape).astype(np.float32)
    found = looks_like(picture, opacity)
    assert found[:, :30].mean() > 0.95 < found[21:, 30:].mean() and not found[:19, 30:].any()


def test_where_too_few_others_look_nothing_is_contradicted(scene: Scene) -> None:
    silhouettes = [np.ones((SIZE, SIZE), bool) for _ in range(3)]
    silhouettes[0][20:28, 20:28] = False
    assert not any(found.any() for found in contradicted(scene.cameras[:3], silhouettes, 0.5))


def test_a_camera_beside_the_subject_and_one_without_a_silhouette_break_nothing(scene: Scene) -> None:
    colours, opacities = cut_outs(scene)
    w2c = scene.cameras[0].w2c.copy()
    w2c[2, 3] = 0  # the subject's middle lies beside it
    cameras, silhouettes = [replace(scene.cameras[0], w2c=w2c), *scene.cameras[1:]], [one > 0.5 for one in opacities]
    silhouettes[0][:] = False
    assert len(contradicted(cameras, silhouettes, 0.5)) == CAMERAS
    assert looks_like(colours[0] + 0.5, np.zeros((SIZE, SIZE), np.float32)).shape == (SIZE, SIZE)


def test_a_file_of_another_program(scene: Scene, splats: Splats, tmp_path: Path) -> None:
    """Of a head that turns it is brought into the head's own frame."""
    opaque = Splats(splats.values, np.zeros(3, np.float32))
    write_ply(tmp_path / "a.ply", moved(opaque, scene.from_capture.inverse()))
    found = read_start(tmp_path / "a.ply", scene)
    for camera in scene.cameras[:2]:
        np.testing.assert_allclose(render(found, camera)[0], render(opaque, camera)[0], atol=5e-3)
    turned = replace(scene, poses=Track.of([about((0, 0, 1), 11.5)], [[0.02, 0.05, 0]]))
    seen = render(read_start(tmp_path / "a.ply", turned), turned.camera_in_head(0, 0))[0]
    np.testing.assert_allclose(seen, render(opaque, scene.cameras[0])[0], atol=5e-3)
    write_ply(tmp_path / "b.ply", opaque)  # in the scene's coordinates, not in the capture's
    with pytest.raises(UserError, match="do not show"):
        read_start(tmp_path / "b.ply", scene)
