"""The OpenGL renderer against the reference renderer; the cameras of films; the command `render`."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest
from click.testing import Result
from numpy.typing import NDArray
from PIL import Image
from typer.testing import CliRunner

from facefolds_core.asset import Asset
from facefolds_core.asset.manifest_extras import Directions, FilmedView
from facefolds_core.cli import app
from facefolds_core.cli.render import Kind, film_path, film_rate, parse_colour, parse_size, shrink, write_film
from facefolds_core.errors import UserError
from facefolds_core.rendering.camera_paths import Eye, camera_of, distance_to_fit, fly_through, frame_due, turntable
from facefolds_core.rendering.opengl import OpenGLRenderer
from facefolds_core.rendering.pixels import render
from facefolds_core.rendering.reference import AssetCaster, composite, seen_from
from facefolds_core.rendering.reflection import reflected_colours
from tests.asset.test_audio import tone
from tests.assets import SOURCE, make_asset
from tests.engines.tracks import over_torso, with_track
from tests.pictures import psnr, render_asset
from tests.scenes import look_at_origin, view_of
from tests.viewer.fixtures import change_manifest, file_entry, random_reflection, shining


@pytest.fixture(scope="module")
def caps(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    return make_asset(tmp_path_factory.mktemp("opengl") / "asset", layers=5, frames=3, resolution=64)


def test_it_agrees_with_the_reference(caps: Asset) -> None:
    """Several cameras (grazing: sheets are crossed twice), sizes and frames; an off-centre principal point."""
    plain = [look_at_origin("camera", *angles, 120) for angles in ((0, 0), (45, 0), (-30, 35), (80, 5))]
    K = plain[1].K + np.array([[0, 0.3, 7], [0, 20, -4], [0, 0, 0]])
    cameras = [*plain, replace(plain[1], K=K, width=130, height=90)]
    caster = AssetCaster(caps)
    with OpenGLRenderer(caps) as renderer:
        for camera in cameras:
            hits = caster.cast(camera)
            for frame in (0, 2):
                expected, opacity = composite(hits, caps.frame(frame), (0.2, 0.4, 0.6))
                rgb, alpha = renderer.render(camera, frame, (0.2, 0.4, 0.6))
                # Seen: 58 dB and more; single pixels at the outline of a sheet may fall to its other side.
                assert psnr(rgb, expected) > 45
                assert psnr(alpha, opacity) > 45


def test_reflections_agree_with_the_reference(caps: Asset) -> None:
    camera, maps = look_at_origin("camera", 30, 10, 120), random_reflection()
    hits, windows = AssetCaster(caps).cast(camera), caps.full.windows
    expected, _ = composite(hits, caps.frame(1), added=reflected_colours(hits, camera, windows, maps))
    plain, _ = composite(hits, caps.frame(1))
    with OpenGLRenderer(caps, maps) as renderer:
        rgb, _ = renderer.render(camera, 1)
    assert psnr(rgb, expected) > 45
    assert psnr(plain, expected) < 25


def test_the_light_stays_with_the_room_where_the_head_turns(caps: Asset) -> None:
    level, camera, maps = with_track(caps.full, 40), look_at_origin("camera", 30, 10, 120), random_reflection()
    seen_by, windows = seen_from(level, camera, 2), level.windows
    assert level.track is not None
    hits, turned = AssetCaster(level).cast(seen_by), level.track.at(2).rotation
    expected, _ = composite(hits, level.frame(2), added=reflected_colours(hits, seen_by, windows, maps, turned))
    along, _ = composite(hits, level.frame(2), added=reflected_colours(hits, seen_by, windows, maps))
    with OpenGLRenderer(level, maps) as renderer:
        rgb, _ = renderer.render(camera, 2)
    assert psnr(rgb, expected) > 45
    assert psnr(along, expected) < 25  # light that turns with the head is another picture


def test_a_torso_stays_in_the_room(caps: Asset) -> None:
    level, camera = with_track(caps.full, 30), look_at_origin("camera", 30, 10, 120)
    over = over_torso(level)
    expected, whole = (render_asset(one, camera, 2)[0] for one in (over, level))
    with OpenGLRenderer(over) as renderer:
        rgb, _ = renderer.render(camera, 2)
    assert psnr(rgb, expected) > 45
    assert psnr(whole, expected) < 25


def test_a_background_picture_shines_through(caps: Asset) -> None:
    camera = look_at_origin("camera", 0, 0, 40)
    background = np.random.default_rng(0).uniform(0, 1, (40, 40, 3)).astype(np.float32)
    with OpenGLRenderer(caps) as renderer:
        rgb, alpha = renderer.render(camera, 0, background)
    assert (alpha == 0).any()
    np.testing.assert_array_equal(rgb[alpha == 0], background[alpha == 0])


def test_a_picture_larger_than_the_card_allows(caps: Asset) -> None:
    camera = camera_of(Eye(), 100_000, 16, 30)
    with OpenGLRenderer(caps) as renderer, pytest.raises(UserError, match="too large"):
        renderer.render(camera, 0)


def test_an_eye_looks_at_its_target_upright() -> None:
    eye = Eye(azimuth=30, elevation=20, distance=2, target=(0.1, 0.2, 0.3))
    camera = camera_of(eye, 200, 100, 30)
    pixels, depth = camera.project(np.array([eye.target, [0.1, 0.2, 0.4]]))
    np.testing.assert_allclose(pixels[0], [100, 50])
    assert depth[0] == pytest.approx(2)
    assert pixels[1, 0] == pytest.approx(100)
    assert pixels[1, 1] < 50  # up in the world is up in the picture
    # The shorter side spans the field of view: its end is at 15 degrees.
    edge = np.linalg.inv(camera.K) @ [100, 0, 1]
    assert np.degrees(np.arctan(-edge[1])) == pytest.approx(15)
    assert camera_of(Eye(azimuth=90), 10, 10, 30).centre == pytest.approx([0, 1, 0])  # to the subject's left


def test_from_the_distance_to_fit_a_box_just_fills_the_picture() -> None:
    """Half a picture of 30 degrees spans tan 15 of the distance to the box's nearest side, 0.2 before the target."""
    low, high = (-0.1, -0.1, -0.3), (0.2, 0.1, 0.3)
    found = distance_to_fit(low, high, [Eye()], 200, 100, 30)
    assert found == pytest.approx(0.2 + 0.3 / np.tan(np.radians(15)))
    aside = [Eye(azimuth=90), Eye(azimuth=-90)]
    assert distance_to_fit(low, high, [Eye(), *aside], 200, 100, 30) == pytest.approx(found)
    flat = (-0.5, -0.1, -0.1), (0.5, 0.1, 0.1)
    assert distance_to_fit(*flat, aside, 100, 100, 30) == pytest.approx(0.1 + 0.5 / np.tan(np.radians(15)))


@pytest.mark.parametrize("path", [lambda start, n: turntable(start, n, (50, 50)), fly_through])
def test_films_are_closed_and_stay_in_front(path: object) -> None:
    start = Eye(azimuth=5, elevation=3, distance=1.5)
    eyes = path(start, 48)  # type: ignore[operator]
    assert eyes[0] == start
    azimuths = np.array([eye.azimuth for eye in eyes])
    assert np.abs(azimuths - 5).max() == pytest.approx(50, abs=11)
    steps = np.abs(np.diff([*azimuths, azimuths[0]]))
    assert steps.max() < 8  # no jump, not at the end either
    assert min(eye.distance for eye in eyes) > 0.9


FILMED = FilmedView(azimuth=(-30, 20), elevation=(-5, 10))


def test_films_stay_where_the_asset_was_filmed() -> None:
    wide, high = film_path(None, Kind.TURNTABLE, Eye(), 48, None), film_path(None, Kind.FLY, Eye(), 48, None)
    assert [max(eye.azimuth for eye in eyes) for eyes in (wide, high)] == pytest.approx([55, 40], abs=0.5)
    for kind in (Kind.TURNTABLE, Kind.FLY):
        eyes = film_path(FILMED, kind, Eye(azimuth=5), 48, None)
        azimuths, elevations = [eye.azimuth for eye in eyes], [eye.elevation for eye in eyes]
        assert (min(azimuths), max(azimuths)) == pytest.approx((-34, 24))
        assert min(elevations) >= -9 and max(elevations) <= 14
    good = FILMED.model_copy(update={"good": Directions(azimuth=(-20, 15), elevation=(-2, 6))})
    within = film_path(good, Kind.FLY, Eye(azimuth=5), 48, None)
    assert (min(eye.azimuth for eye in within), max(eye.azimuth for eye in within)) == pytest.approx((-20, 15))
    assert (min(eye.elevation for eye in within), max(eye.elevation for eye in within)) == pytest.approx((-2, 6))
    asked = film_path(FILMED, Kind.TURNTABLE, Eye(), 48, 90)
    assert max(eye.azimuth for eye in asked) == pytest.approx(90)
    behind = film_path(FILMED, Kind.TURNTABLE, Eye(azimuth=180), 48, None)  # asked for as well
    assert [min(eye.azimuth for eye in behind), max(eye.azimuth for eye in behind)] == pytest.approx([125, 235])


@pytest.mark.parametrize(
    ("asset", "frames", "wanted", "expected"),
    [
        (Fraction(8), 12, None, 30),
        (Fraction(30000, 1001), 12, None, Fraction(30000, 1001)),
        (Fraction(24), 12, None, 24),
        (Fraction(60), 12, None, 60),
        (Fraction(60), 1, None, 30),
        (Fraction(8), 12, 59.94, Fraction(2997, 50)),
    ],
)
def test_the_rate_of_a_film(asset: Fraction, frames: int, wanted: float | None, expected: Fraction) -> None:
    assert film_rate(asset, frames, wanted) == expected


@pytest.mark.parametrize("height", [36, 38])
def test_a_film_may_be_of_any_even_size(height: int, tmp_path: Path) -> None:
    """Of 38 rows, chroma has 19, which are no whole rows of luma."""
    picture = np.full((height, 64, 3), (200, 40, 40), np.uint8)
    write_film(tmp_path / "film.mp4", iter([picture] * 3), (64, height), Fraction(24))
    with av.open(str(tmp_path / "film.mp4")) as film:
        seen = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(seen) == 3 and np.abs(np.array(seen, int) - picture).max() < 12


def test_a_film_shows_the_frame_that_a_player_would() -> None:
    thirty, eight = Fraction(30), Fraction(8)
    shown = [frame_due(index, thirty, eight, 12) for index in range(46)]
    assert shown == [*np.repeat(range(12), 3 * [4, 4, 4, 3]), 0]  # 12 frames are a second and a half
    assert [frame_due(index, eight, eight, 3, first=2) for index in range(4)] == [2, 0, 1, 2]
    assert [frame_due(index, eight, thirty, 12) for index in range(4)] == [0, 3, 7, 11]


def test_shrinking_takes_means() -> None:
    rgb = np.zeros((4, 6, 3), np.float32)
    rgb[:2, :2] = 1
    rgb[0, 2] = 1
    found = shrink(rgb, 2)
    assert found.shape == (2, 3, 3)
    assert found[0, 0].tolist() == [255] * 3
    assert found[0, 1].tolist() == [64] * 3


@pytest.mark.parametrize("text", ["720", "0x10", "axb", "-5x20", "641x480"])
def test_sizes_and_colours_that_are_none(text: str) -> None:
    with pytest.raises(UserError, match="no size"):
        parse_size(text, film=True)
    with pytest.raises(UserError, match="no colour"):
        parse_colour("red")
    assert parse_colour("#ff0033") == (1, 0, 0.2)


def run(*arguments: str | Path) -> Result:
    """`facefolds render ARGUMENTS`, in this process."""
    return CliRunner().invoke(app, ["render", *map(str, arguments)])


def still(asset: Asset, out: Path, *look: str | Path) -> NDArray[np.float64]:
    """Frame 1 over #336699, as the command writes it."""
    done = run(asset.folder, "--out", out, "--frame", "1", "--background", "#336699", *look)
    assert done.exit_code == 0, done.output
    return np.asarray(Image.open(out)) / 255


def test_a_still(caps: Asset, tmp_path: Path) -> None:
    look = "--azimuth=20", "--distance=1", "--size=80x60", "--samples=1"
    shown = still(caps, tmp_path / "still.png", *look)
    camera = camera_of(Eye(azimuth=20), 80, 60, 30)
    expected, _ = composite(AssetCaster(caps).cast(camera), caps.frame(1), (0.2, 0.4, 0.6))
    assert psnr(shown, expected) > 42


def test_by_default_a_still_shows_means_over_pixels(caps: Asset, tmp_path: Path) -> None:
    """With the reflection, as the library's own `render`."""
    asset = shining(caps, tmp_path / "asset")
    camera = look_at_origin("camera", 35, 10, 64)
    (tmp_path / "camera.json").write_text(json.dumps(view_of(camera)))
    shown = still(asset, tmp_path / "still.png", "--camera", tmp_path / "camera.json")
    assert psnr(shown, render(asset, camera, 1, (0.2, 0.4, 0.6))[0]) > 55  # seen: 62.7


@pytest.mark.parametrize(("options", "rate", "count"), [([], 30, 30), (["--fps", "12.5"], 12.5, 12)])
def test_a_films_camera_moves_more_often_than_the_sequence(
    tmp_path: Path, options: list[str], rate: float, count: int
) -> None:
    make_asset(tmp_path / "asset", frames=3, resolution=32, source=replace(SOURCE, fps=4.0))
    sound = tone(tmp_path / "asset" / "audio.wav", 0.75)
    change_manifest(tmp_path / "asset", lambda value: value.update(audio=file_entry(sound)))
    film = ["--kind", "turntable", "--size", "64x48", "--seconds", "1", "--out", tmp_path / "film.mp4"]
    done = run(tmp_path / "asset", *film, *options)
    assert done.exit_code == 0, done.output
    with av.open(str(tmp_path / "film.mp4")) as container:
        video = container.streams.video[0]
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video)]
        assert video.average_rate == rate and video.duration is not None and video.time_base is not None
        assert float(video.duration * video.time_base) == pytest.approx(1, abs=0.51 / rate)
    with av.open(str(tmp_path / "film.mp4")) as container:
        assert sum(frame.samples for frame in container.decode(audio=0)) == pytest.approx(48_000, abs=4800)
    assert len(pictures) == count and pictures[0].shape == (48, 64, 3)
    assert all((a != b).any() for a, b in pairwise(pictures))  # the camera moves in each


def test_where_no_camera_stood_is_said(tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", frames=1, resolution=32)
    change_manifest(tmp_path / "asset", lambda value: value.update(view=FILMED.model_dump(exclude_none=True)))
    small = ["--size", "64x48", "--samples", "1"]
    still, film = ["--out", tmp_path / "a.png"], ["--out", tmp_path / "a.mp4", "--seconds", "0.4"]
    (tmp_path / "behind.json").write_text(json.dumps(view_of(look_at_origin("behind", 180, 0, 64))))
    for arguments, said in (
        ([*still, "--azimuth", "180"], "this looks from where no camera stood, 150 degrees beyond"),
        ([*still, "--azimuth", "340"], ""),
        ([*still, "--camera", tmp_path / "behind.json"], "150 degrees beyond"),
        ([*film, "--kind", "turntable"], ""),
        ([*film, "--kind", "fly"], ""),
        ([*film, "--kind", "turntable", "--sweep", "60"], "8 of 12 pictures look from where no camera stood, 40 deg"),
    ):
        done = run(tmp_path / "asset", *arguments, *small)
        assert done.exit_code == 0, done.output
        if said:
            assert said in done.stderr and "azimuth -30 to 20 and elevation -5 to 10" in done.stderr
        else:
            assert done.stderr == ""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--out", "a.mp4"], "wrong kind of file"),
        (["--out", "a.png", "--frame", "9"], "no such frame"),
        (["--out", "a.png", "--level", "tiny"], "no such level"),
    ],
)
def test_what_it_refuses(caps: Asset, arguments: list[str], said: str) -> None:
    done = run(caps.folder, *arguments)
    assert done.exit_code == 1
    assert said in done.stderr
    assert "remedy" in done.stderr
