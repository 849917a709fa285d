"""From a capture's pictures to the scene's: decoded, freed from distortion, averaged down, colours corrected.

Pictures come in the order of the rows. Cores develop them side by side; a video is decoded once, in order, with
FFmpeg's own threads. Memory holds a few pictures a core, however long the capture is.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

from facefolds_core.captures.capture import Capture, check_plate_size, wrong_size
from facefolds_core.captures.images import corrected_colour, display_colour, downsample, to_8bit
from facefolds_core.captures.lens import Lens, undistort
from facefolds_core.captures.picture import Picture, VideoFrame
from facefolds_core.captures.videos import CameraVideo, Channels
from facefolds_core.files.frame_store import Image
from facefolds_core.params import NormalizeParams
from facefolds_core.system.threads import in_order


@dataclass(frozen=True)
class Negative:
    """A picture to develop.

    Attributes:
        key: (camera, frame) in the scene.
        view: index of the camera in the capture.
        picture: where it lies.
        place: in words.
    """

    key: tuple[int, int]
    view: int
    picture: Picture
    place: str


Row = tuple[int, int, Image]
"""Camera and frame in the scene, and the picture."""


def photos(
    capture: Capture, negatives: Sequence[Negative], width: int, height: int, params: NormalizeParams
) -> Iterator[Row]:
    """Colour pictures (height, width, 3)."""

    def finish(negative: Negative, photo: Image) -> Image:
        colour = capture.views[negative.view].colour
        if colour is None and not params.display_colour:
            return _averaged(photo, width, height)
        values = downsample(photo, width, height)
        if colour is not None:
            values = corrected_colour(values, colour)
        return to_8bit(display_colour(values) if params.display_colour else values)

    return _developed(capture, negatives, "rgb", width, finish)


def opacities(capture: Capture, negatives: Sequence[Negative], width: int, height: int) -> Iterator[Row]:
    """Masks or mattes (height, width, 1)."""
    return _developed(capture, negatives, "opacity", width, lambda _, mask: _averaged(mask, width, height))


def _averaged(photo: Image, width: int, height: int) -> Image:
    """(height, width, C): area averages, rounded."""
    return photo if photo.shape[:2] == (height, width) else to_8bit(downsample(photo, width, height))


def _developed(
    capture: Capture,
    negatives: Sequence[Negative],
    channels: Channels,
    width: int,
    finish: Callable[[Negative, Image], Image],
) -> Iterator[Row]:
    """Rows of the scene, a bounded number of them ahead of who asks."""

    def develop(negative: Negative, photo: Image) -> Row:
        camera = capture.views[negative.view].camera
        size = photo.shape[1], photo.shape[0]
        if negative.picture is capture.plates.get(negative.view):
            check_plate_size(capture, negative.view, size)
        elif size != (camera.width, camera.height):
            expected = f"{camera.width} x {camera.height}, as its header says"
            raise wrong_size(negative.picture.file, negative.place, size, expected)
        lens = capture.views[negative.view].lens
        straight = photo if lens is None else undistort(photo, _maps(lens, *size))
        return (*negative.key, finish(negative, straight))

    def single(negative: Negative) -> Row:
        picture, place = negative.picture, negative.place
        return develop(negative, picture.rgb(place) if channels == "rgb" else picture.opacity(place))

    def work() -> Iterator[Callable[[], Row]]:
        for video, group in itertools.groupby(negatives, _video_of):
            wanted = list(group)
            if video is None:
                yield from (partial(single, negative) for negative in wanted)
                continue
            fine = 4 * width > 3 * capture.views[wanted[0].view].camera.width
            indices = [one.picture.index for one in wanted if isinstance(one.picture, VideoFrame)]
            for negative, photo in zip(wanted, video.frames(indices, channels, threads=0, fine=fine), strict=True):
                yield partial(develop, negative, photo)

    return in_order(work())


def _video_of(negative: Negative) -> CameraVideo | None:
    return negative.picture.video if isinstance(negative.picture, VideoFrame) else None


_maps = lru_cache(maxsize=8)(Lens.maps)
"""Kept while the frames of a camera are read."""
