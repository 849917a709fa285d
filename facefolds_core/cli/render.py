"""Make stills and films of an asset: `facefolds render data/<subject>/asset --out face.png`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from fractions import Fraction
from operator import attrgetter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.api.cameras import camera_named, cameras_of_asset
from facefolds_core.asset import read_asset
from facefolds_core.asset.audio import write_film_with_sound
from facefolds_core.asset.codecs import CODECS
from facefolds_core.asset.colour import rgb_to_yuv420
from facefolds_core.asset.filmed import direction_of, swing_filmed, unfilmed_words
from facefolds_core.asset.manifest_extras import FilmedView
from facefolds_core.asset.reader import Asset, AssetLevel
from facefolds_core.asset.video import encode_video
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import atomic_file, read_json
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import VideoCodec
from facefolds_core.rendering.camera_paths import (
    SIDEWAYS,
    UP,
    Eye,
    Sides,
    camera_of,
    distance_to_fit,
    fly_through,
    frame_due,
    turntable,
)
from facefolds_core.rendering.opengl import OpenGLRenderer
from facefolds_core.rendering.pixels import SIDE, finer, pixel_means

FILM_RATE = Fraction(30)
"""Pictures a second of a film whose asset has fewer than `OWN_RATE` frames a second: a camera that moves less often
jerks."""
OWN_RATE = 24
"""Frames a second of an asset from which on a film takes its rate: each picture shows another frame."""
WIDEST = 55.0
"""Degrees to each side, of a turntable."""
FILM = VideoCodec(crf=16, preset="medium")
SMALLEST_SIDE = 16
LARGEST_SIDE = 16_384
"""Pixels; the latter with anti-aliasing: what graphics drivers draw at once."""
LIMITS = {
    "azimuth": (-3600.0, 3600.0),
    "elevation": (-3600.0, 3600.0),
    "distance": (1e-3, 1e3),
    "field-of-view": (1.0, 150.0),
    "seconds": (0.1, 3600.0),
    "fps": (1.0, 240.0),
    "sweep": (-3600.0, 3600.0),
}
"""Options with numbers, from and to. The command line's own check of bounds lets `nan` through."""
SUFFIXES = {"still": ".png", "turntable": ".mp4", "fly": ".mp4"}


class Kind(StrEnum):
    """What is made."""

    STILL = "still"
    TURNTABLE = "turntable"
    FLY = "fly"


def _refused(option: str, message: str, expected: str, found: object, remedy: str) -> UserError:
    return UserError(message, place=f"--{option}", expected=expected, found=found, remedy=remedy)


def parse_size(text: str, film: bool) -> tuple[int, int]:
    """Width and height from "1280x720".

    Raises:
        UserError: if it is no size, or odd numbers where a film is made (its colours are stored 2 x 2).
    """
    match = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", text)
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    if min(size) < SMALLEST_SIDE or (film and (size[0] % 2 or size[1] % 2)):
        expected = f"WIDTHxHEIGHT in pixels, at least {SMALLEST_SIDE}{', even' if film else ''}"
        raise _refused("size", "no size for a picture", expected, text, "such as 1280x720")
    return size


def check_limits(**options: float) -> None:
    """Refuse numbers of options beyond `LIMITS`, and those that are none.

    Raises:
        UserError: naming the option.
    """
    for name, value in options.items():
        option = name.replace("_", "-")
        low, high = LIMITS[option]
        if not low <= value <= high:
            raise _refused(option, "a number out of bounds", f"{low:g} to {high:g}", value, "choose one within")


def parse_colour(text: str) -> tuple[float, float, float]:
    """RGB in [0, 1] from "#16181d".

    Raises:
        UserError: if it is no colour.
    """
    if not re.fullmatch(r"#?[0-9a-fA-F]{6}", text):
        raise _refused("background", "no colour", "#rrggbb", text, "such as #16181d")
    red, green, blue = bytes.fromhex(text.removeprefix("#"))
    return red / 255, green / 255, blue / 255


def pick_level(asset: Asset, name: str | None) -> AssetLevel:
    """The level of that name; the full one for None.

    Raises:
        UserError: if there is none of that name.
    """
    for level in asset.levels:
        if level.entry.name == name:
            return level
    if name is not None:
        names = ", ".join(level.entry.name for level in asset.levels)
        raise _refused("level", "no such level of detail", names, name, "choose one of these")
    return asset.full


def named_camera(asset: Asset, name: str) -> Camera:
    """The camera of that name, in the world of the asset.

    Raises:
        UserError: if there is none, listing those that there are; or if the file holds none.
    """
    if name.endswith(".json"):
        return _from_file(Path(name))
    none = "FILE.json: this asset names no camera, and there is no scene beside it"
    known = cameras_of_asset(asset, asset.folder.resolve().parent)
    return camera_named(name, known, "--camera", none, ", or give a JSON file with K, w2c, width and height")


def _from_file(path: Path) -> Camera:
    remedy = "give one as an object with K by rows, w2c = (R | t) by rows, width, height"
    value = read_json(path, remedy=remedy)
    try:
        K, w2c = np.array(value["K"], float), np.array(value["w2c"], float)
        width, height = int(value["width"]), int(value["height"])
        rotation = w2c[:, :3]
        sound = K.shape == (3, 3) and w2c.shape == (3, 4) and np.isfinite(K).all() and np.isfinite(w2c).all()
        sound = (
            sound
            and min(width, height) >= SMALLEST_SIDE
            and max(width, height) <= LARGEST_SIDE
            and K[0, 0] > 0
            and K[1, 1] > 0
        )
        sound = sound and np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-2 and np.linalg.det(rotation) > 0
    except (KeyError, TypeError, ValueError, IndexError):
        sound = False
    if not sound:
        raise UserError("no camera in the file", file=path, expected="K, w2c, width and height", remedy=remedy)
    return Camera(path.stem, K, w2c, width, height)


def shrink(rgb: NDArray[np.float32], samples: int) -> NDArray[np.uint8]:
    """(samples H, samples W, 3) in [0, 1] -> (H, W, 3) bytes, means of samples x samples pixels."""
    return np.asarray(np.rint(np.clip(pixel_means(rgb, samples), 0, 1) * 255), np.uint8)


def far_enough(asset: Asset, eyes: Sequence[Eye], width: int, height: int, field_of_view: float) -> float:
    """1, as the capture's cameras, or the distance from which the whole asset is in the picture from all `eyes`."""
    box = asset.manifest.bounds
    return 1.0 if box is None else max(1.0, distance_to_fit(box.min, box.max, eyes, width, height, field_of_view))


def film_rate(asset: Fraction, frames: int, wanted: float | None) -> Fraction:
    """Pictures a second of a film: as wanted; else the asset's own rate, or `FILM_RATE` where that is low.

    Args:
        asset: its frames a second.
        frames: of the asset.
    """
    if wanted is not None:
        return Fraction(wanted).limit_denominator(1001)
    return asset if frames > 1 and asset >= OWN_RATE else FILM_RATE


def room_within(good: Sides, start: float, most: Sides) -> Sides:
    """Degrees to both sides of `start` that are good, of `most`; all of them where it begins beyond."""
    low, high = start - good[0], good[1] - start
    return most if min(low, high) < 0 else (min(most[0], low), min(most[1], high))


def film_path(view: FilmedView | None, kind: Kind, start: Eye, count: int, sweep: float | None) -> list[Eye]:
    """Where the camera is in each picture of a film: where the asset is good, but for a sweep that is asked for.

    Args:
        view: what was filmed and what of it is good, if that is known.
        count: pictures.
        sweep: degrees to each side, of a turntable; None for `WIDEST`, or as far as was filmed.
    """
    sideways = WIDEST if kind is Kind.TURNTABLE else SIDEWAYS
    sides, heights = (sideways, sideways), (UP, UP)
    if view is not None:
        sides, heights = swing_filmed(view, start.azimuth, start.elevation, sideways, UP)
        if view.good is not None:
            sides = room_within(view.good.azimuth, start.azimuth, sides)
            heights = room_within(view.good.elevation, start.elevation, heights)
    if kind is Kind.FLY:
        return fly_through(start, count, sides, heights)
    return turntable(start, count, sides if sweep is None else (sweep, sweep))


def command(
    asset: Annotated[Path, typer.Argument(help="Folder of the asset: it holds manifest.json.")],
    out: Annotated[Path, typer.Option(help="File to write: .png for a still, .mp4 for a film.")],
    kind: Annotated[
        Kind,
        typer.Option(help="still: one picture; turntable: a film from side to side; fly: a flight around the face"),
    ] = Kind.STILL,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT in pixels.")] = "1280x720",
    frame: Annotated[int, typer.Option(help="Frame of the sequence; a film begins with it.")] = 0,
    azimuth: Annotated[float, typer.Option(help="Degrees from the front, positive to the subject's left.")] = 0.0,
    elevation: Annotated[float, typer.Option(help="Degrees upwards.")] = 0.0,
    distance: Annotated[
        float | None,
        typer.Option(
            help="From the subject; the capture's cameras are about 1 away. Left out: 1, or what it takes to show all."
        ),
    ] = None,
    field_of_view: Annotated[float, typer.Option(help="Degrees, of the shorter side.", min=1, max=150)] = 30.0,
    background: Annotated[str, typer.Option(help="Colour behind the subject, #rrggbb.")] = "#16181d",
    seconds: Annotated[float, typer.Option(help="Length of a film; the sequence repeats as needed.", min=0.1)] = 8.0,
    fps: Annotated[
        float | None,
        typer.Option(
            help="Pictures a second of a film; the camera moves in each, the sequence keeps its own time. "
            "Left out: as the sequence, or 30 where that has fewer than 24."
        ),
    ] = None,
    sweep: Annotated[
        float | None,
        typer.Option(help="Degrees to each side, of a turntable. Left out: 55, or as far as was filmed."),
    ] = None,
    samples: Annotated[int, typer.Option(help="A pixel is the mean of samples x samples rays.", min=1, max=4)] = SIDE,
    reflection: Annotated[bool, typer.Option(help="With the reflection, where the asset has one.")] = True,
    level: Annotated[str | None, typer.Option(help="Level of detail by name; the full one if left out.")] = None,
    camera: Annotated[
        str | None,
        typer.Option(help="`poster`, a camera of the capture by its name, or FILE.json with K, w2c, width, height."),
    ] = None,
) -> None:
    """Render an asset with OpenGL, without a screen: a PNG still, or an MP4 film in which the sequence plays."""
    with report_user_errors("render"):
        width, height = parse_size(size, kind is not Kind.STILL)
        colour = parse_colour(background)
        if samples * max(width, height) > LARGEST_SIDE:
            expected = f"at most {LARGEST_SIDE // samples} pixels a side with --samples {samples}"
            raise _refused("size", "too large a picture", expected, size, "a smaller one")
        check_limits(azimuth=azimuth, elevation=elevation, field_of_view=field_of_view)
        check_limits(distance=1.0 if distance is None else distance)
        check_limits(seconds=seconds, sweep=sweep or 0.0, fps=1.0 if fps is None else fps)
        if out.suffix.lower() != SUFFIXES[kind]:
            remedy = f"name a file that ends in {SUFFIXES[kind]}, or choose another --kind"
            raise UserError(f"the wrong kind of file for {kind.value}", file=out, remedy=remedy)
        read = read_asset(asset)
        shown = pick_level(read, level)
        if not 0 <= frame < shown.num_frames:
            raise _refused("frame", "no such frame", f"0 to {shown.num_frames - 1}", frame, "choose one of these")
        given = None if camera is None else named_camera(read, camera)
        if given is not None:
            width, height = given.width, given.height
            if kind is not Kind.STILL:
                raise UserError("a film of one camera", place="--camera", remedy="leave out --kind, or --camera")
        view, texture = read.manifest.view, shown.entry.texture
        rate = film_rate(texture.rate, shown.num_frames, fps)
        start, eyes = Eye(azimuth, elevation), [Eye(azimuth, elevation)]
        if kind is not Kind.STILL:
            eyes = film_path(view, kind, start, max(2, round(seconds * rate)), sweep)
        seen = [direction_of(given)] if given is not None else [(eye.azimuth, eye.elevation) for eye in eyes]
        if view is not None and (words := unfilmed_words(view, seen)):
            typer.echo(f"render: warning: {words}", err=True)
        turns = (
            [min(eyes, key=attrgetter("azimuth")), start, max(eyes, key=attrgetter("azimuth"))]
            if kind is Kind.TURNTABLE
            else [start]
        )
        away = far_enough(read, turns, width, height, field_of_view) if distance is None else distance
        with OpenGLRenderer(shown, shown.reflection() if reflection else None) as renderer:

            def shot(camera: Camera, index: int) -> NDArray[np.uint8]:
                return shrink(renderer.render(finer(camera, samples), index, colour)[0], samples)

            def picture(eye: Eye, index: int) -> NDArray[np.uint8]:
                far = replace(eye, distance=away * eye.distance)
                return shot(camera_of(far, width, height, field_of_view), index)

            with atomic_file(out) as temporary:
                if given is not None:
                    Image.fromarray(shot(given, frame)).save(temporary)
                elif kind is Kind.STILL:
                    Image.fromarray(picture(start, frame)).save(temporary)
                else:
                    due = (frame_due(i, rate, texture.rate, shown.num_frames, frame) for i in range(len(eyes)))
                    write_film(temporary, map(picture, eyes, due), (width, height), rate)
                    add_sound(temporary, read, frame, texture.rate, shown.num_frames)
            typer.echo(f"render: {out} ({width} x {height}, {renderer.device})")


def write_film(path: Path, pictures: Iterator[NDArray[np.uint8]], size: tuple[int, int], rate: Fraction) -> None:
    """H.264 in MP4, BT.709."""
    width = size[0]
    planes = (rgb_to_yuv420(picture) for picture in pictures)
    planar = (np.concatenate([plane.ravel() for plane in three]).reshape(-1, width) for three in planes)
    codec = CODECS["h264"]
    encode_video(path, planar, size, rate, codec, codec.options(FILM, FILM.crf))


def add_sound(film: Path, asset: Asset, frame: int, rate: Fraction, frames: int) -> None:
    """The sequence's sound under a film that begins with `frame`, if the asset has one."""
    if asset.manifest.audio is None:
        return
    with atomic_file(film) as temporary:
        write_film_with_sound(temporary, film, asset.folder / asset.manifest.audio.file, frames / rate, frame / rate)
