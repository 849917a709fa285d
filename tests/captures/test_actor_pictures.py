"""What the actor's renderer shows, on tiny pictures."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from facefolds_core.captures.actor import ActorOptions, ActorPicture, camera_at, render, tracked_mesh
from facefolds_core.captures.actor.motion import BLINK, pose_at
from facefolds_core.geometry.cameras import Camera

TO_WORLD = np.diag([1.0, -1.0, -1.0])
WIDTH, HEIGHT = 48, 72
OPEN_MOUTH, SHUT_EYES = 1.8, 1.0


def to_world(points: np.ndarray) -> np.ndarray:
    return points.astype(float) @ TO_WORLD + np.array([0.0, 0.0, 1000.0])


def frontal(width: int = WIDTH, height: int = HEIGHT) -> Camera:
    return camera_at("front", 0.0, 0.0, width, height)


def colour_at(picture: ActorPicture, camera: Camera, point: np.ndarray) -> np.ndarray:
    (x, y), _ = camera.project(to_world(point))
    return picture.rgb[int(y), int(x)].astype(float)


@pytest.fixture(scope="module")
def rest() -> ActorPicture:
    return render(frontal(), 0.0)


def test_a_picture_has_colour_opacity_and_depth_and_the_room_none(rest: ActorPicture) -> None:
    assert (rest.rgb.shape, rest.rgb.dtype) == ((HEIGHT, WIDTH, 3), np.uint8)
    assert rest.opacity.shape == rest.depth.shape == (HEIGHT, WIDTH)
    assert rest.opacity.dtype == rest.depth.dtype == np.float32
    assert (rest.opacity.min(), rest.opacity.max()) == (0.0, 1.0)
    assert np.all(rest.opacity[:4] == 0)
    assert np.all(np.isinf(rest.depth[:4]))


def test_hair_is_semi_transparent(rest: ActorPicture) -> None:
    # Away from the opaque silhouette, so that only hair can make a fraction.
    no_surface = np.isinf(rest.depth)
    inner = no_surface.copy()
    for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        inner &= np.roll(no_surface, shift, axis)
    partly = inner & (rest.opacity > 0.05) & (rest.opacity < 0.95)
    assert partly.sum() > 30


def test_without_hair_the_top_of_the_head_is_smaller(rest: ActorPicture) -> None:
    bald = render(frontal(), 0.0, ActorOptions(hair_density=0.0))
    assert bald.opacity.sum() < 0.9 * rest.opacity.sum()
    assert np.array_equal(bald.depth, rest.depth)


def test_room_is_static() -> None:
    camera = frontal()
    pictures = [render(camera, time) for time in (0.0, OPEN_MOUTH, SHUT_EYES)]
    room = np.all([p.opacity == 0 for p in pictures], 0)
    assert room.mean() > 0.2
    assert all(np.array_equal(p.rgb[room], pictures[0].rgb[room]) for p in pictures)


@pytest.mark.parametrize("azimuth", [0.0, 50.0, -50.0])
def test_depth_agrees_with_the_tracked_mesh(azimuth: float) -> None:
    camera = camera_at("side", azimuth, 5.0, 96, 144)
    picture = render(camera, OPEN_MOUTH)
    mesh = tracked_mesh(OPEN_MOUTH)
    vertices = mesh.vertices.astype(float)
    normals = trimesh.Trimesh(vertices, mesh.faces, process=False).vertex_normals
    to_eye = TO_WORLD @ (camera.centre - [0, 0, 1000]) - vertices
    facing = (normals * to_eye).sum(1) / np.linalg.norm(to_eye, axis=1) > 0.8
    pixels, depth = camera.project(to_world(vertices[facing]))
    column, row = np.floor(pixels.T).astype(int)
    error = depth - picture.depth[row, column]
    # A pixel is 2.4 mm wide and its depth is that of its centre, up to 1.7 mm aside: with a slope of 0.75 (facing 0.8)
    # 1.3 mm off. Where lips, lids or the nose hide or break the surface inside a pixel, more; few vertices.
    assert np.mean(np.abs(error) < 1.3) > 0.85
    # Nothing that is rendered lies behind the mesh.
    assert np.mean(error < -3.0) < 0.01


def test_any_time_between_frames_differs_from_its_neighbours(rest: ActorPicture) -> None:
    half, opened = (render(frontal(), time) for time in (OPEN_MOUTH - 0.07, OPEN_MOUTH))
    still, between, wide = (picture.rgb[20:56, 14:34].astype(float) for picture in (rest, half, opened))
    apart = np.abs(wide - still).mean()
    assert 0 < np.abs(between - still).mean() < apart
    assert 0 < np.abs(between - wide).mean() < apart


def test_head_stands_still_but_may_move() -> None:
    skull = np.s_[:22]
    still = [render(frontal(), time).opacity[skull] for time in (0.0, 0.5)]
    assert np.array_equal(still[0], still[1])
    moved = render(frontal(), 0.5, ActorOptions(head_motion=0.15)).opacity[skull]
    assert not np.array_equal(moved, still[1])


def test_blink_covers_the_iris(rest: ActorPicture) -> None:
    assert pose_at(SHUT_EYES)[BLINK] == pytest.approx(1.0)
    eye = np.array([32.0, 0.0, 82.0])
    camera = frontal()
    opened, shut = colour_at(rest, camera, eye), colour_at(render(camera, SHUT_EYES), camera, eye)
    assert shut.mean() > opened.mean() + 30  # a dark iris, then skin
    assert shut[0] > shut[2] + 20  # which is reddish


def test_jaw_opens_on_teeth_and_a_dark_mouth() -> None:
    camera = frontal(96, 144)
    picture = render(camera, OPEN_MOUTH)
    teeth = colour_at(picture, camera, np.array([12.0, -69.0, 82.0]))
    inside = np.min([colour_at(picture, camera, np.array([15.0, y, 80.0])).mean() for y in (-72.0, -75.0, -78.0)])
    assert np.ptp(teeth) < 60  # nearly white: skin and lips have a much larger spread
    assert teeth.min() > 90
    assert inside < 60


def test_gloss_moves_with_the_view_and_can_be_turned_up() -> None:
    """What gloss adds to three points from the nose upwards, of two cameras."""
    mesh, added = tracked_mesh(0.0), []
    nose = mesh.vertices[np.argmax(mesh.vertices[:, 2])]
    points = [nose + np.array([0.0, 12.0 * k, -3.0 * k]) for k in range(3)]
    vertices = [mesh.vertices[np.argmin(np.linalg.norm(mesh.vertices - point, axis=1))] for point in points]
    for azimuth in (-30.0, 30.0):
        camera = camera_at("side", azimuth, 5.0, 96, 144)
        dull, *glossy = (render(camera, 0.0, ActorOptions(gloss=gloss)) for gloss in (0.0, 1.0, 3.0))
        added.append([[colour_at(p, camera, v) - colour_at(dull, camera, v) for v in vertices] for p in glossy])
    plain, more = np.abs(np.subtract(*added)).max((1, 2))
    assert plain > 5  # grey levels; 0 without gloss
    assert more > 1.5 * plain


def test_clutter_changes_the_room_and_nothing_else(rest: ActorPicture) -> None:
    picture = render(frontal(), 0.0, ActorOptions(clutter=1.0))
    subject, room = rest.opacity == 1, rest.opacity == 0
    # At the outline a trace of the room shines through where opacity rounds to 1.
    changed = np.abs(picture.rgb[subject].astype(int) - rest.rgb[subject])
    assert np.mean(changed > 0) < 0.01 and changed.max() < 8
    assert np.abs(picture.rgb[room].astype(float) - rest.rgb[room]).mean() > 20
    assert np.abs(picture.opacity - rest.opacity).max() < 0.01  # taken from two pictures, before two rooms


def test_a_longer_nose_stands_out_by_as_much(rest: ActorPicture) -> None:
    longer = render(frontal(), 0.0, ActorOptions(nose=20.0))
    # Seen from the front its tip comes nearer by all of it, and the rest of the face stays.
    assert np.nanmin(rest.depth) - np.nanmin(longer.depth) == pytest.approx(20.0, abs=1.0)
    np.testing.assert_allclose(longer.depth[:26], rest.depth[:26], atol=0.5)  # millimetres: rays are marched in steps
    assert np.ptp(tracked_mesh(0.0, 20.0).vertices[:, 2]) - np.ptp(tracked_mesh(0.0).vertices[:, 2]) > 15


def test_a_ball_before_the_mouth_is_a_disc_of_its_size(rest: ActorPicture) -> None:
    picture = render(frontal(), 0.0, ActorOptions(ball=20.0))
    changed = (picture.depth < rest.depth - 5).sum()
    camera = frontal()
    pixel = (1000 - 168) / camera.K[0, 0]
    assert changed * pixel**2 == pytest.approx(np.pi * 20**2, rel=0.15)
    assert picture.opacity[picture.depth < rest.depth - 5].min() == 1


def test_an_open_shutter_is_the_mean_of_sharp_pictures() -> None:
    shutter = 0.04
    blurred = render(frontal(), OPEN_MOUTH, ActorOptions(shutter=shutter))
    times = OPEN_MOUTH + shutter * np.linspace(-0.5, 0.5, 5)
    mean = np.mean([render(frontal(), float(t)).rgb for t in times], 0)
    assert np.abs(blurred.rgb - mean).max() <= 0.51


@pytest.mark.parametrize(("azimuth", "elevation"), [(180.0, 0.0), (90.0, -60.0), (-120.0, 80.0)])
def test_any_viewpoint_gives_a_whole_head(azimuth: float, elevation: float) -> None:
    picture = render(camera_at("odd", azimuth, elevation, WIDTH, HEIGHT), 0.0)
    assert picture.opacity[HEIGHT // 2, WIDTH // 2] == 1.0
    assert 0.3 < picture.opacity.mean() < 0.95
