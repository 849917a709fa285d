"""From a capture's pictures to the scene's: decoded, freed from distortion, averaged down, colours corrected.

Cores work side by side, and the order of the pictures is the same on every machine: photos come in the order of the
rows; of videos `LANES` are read at once, a picture of each in turn. Memory holds a few pictures a core, however long
the capture is.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.area_kernel import area_mean
from facefolds_core.captures.capture import Capture, check_plate_size, wrong_size
from facefolds_core.captures.images import corrected_colour, display_colour, downsample, to_8bit
from facefolds_core.captures.lens import Lens, undistort
from facefolds_core.captures.picture import Picture, VideoFrame, decoded
from facefolds_core.captures.videos import Channels
from facefolds_core.files.frame_store import Image
from facefolds_core.params import NormalizeParams

T = TypeVar("T")
LANES = 8
"""Videos that are read at once: the order of the rows in the frame store depends on it, so it is no parameter."""
_AHEAD = 3
"""Pictures that a lane may be ahead of the writer."""


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
    """Colour pictures (height, width, 3).

    Raises:
        UserError: if one is damaged, or of another size than its camera's.
    """

    def finish(negative: Negative, photo: Image) -> Image:
        colour = capture.views[negative.view].colour
        if colour is None and not params.display_colour:
            return _averaged_8bit(negative, photo, width, height)
        values = _averaged(negative, photo, width, height)
        if colour is not None:
            values = corrected_colour(values, colour)
        return to_8bit(display_colour(values) if params.display_colour else values)

    return _developed(capture, negatives, "rgb", width, finish)


def opacities(capture: Capture, negatives: Sequence[Negative], width: int, height: int) -> Iterator[Row]:
    """Masks or mattes (height, width, 1); raises like `photos`."""
    return _developed(capture, negatives, "opacity", width, lambda one, mask: _averaged_8bit(one, mask, width, height))


def _averaged(negative: Negative, photo: Image, width: int, height: int) -> NDArray[np.float32]:
    """(height, width, C) in 0..255: area averages."""
    if _quickly(negative, photo, width, height):
        return area_mean(photo, width, height)
    return downsample(photo, width, height)


def _averaged_8bit(negative: Negative, photo: Image, width: int, height: int) -> Image:
    """`_averaged`, rounded."""
    if photo.shape[:2] == (height, width):
        return photo
    if _quickly(negative, photo, width, height):
        return area_mean(photo, width, height, whole=True).astype(np.uint8)
    return to_8bit(downsample(photo, width, height))


def _quickly(negative: Negative, photo: Image, width: int, height: int) -> bool:
    """Whether `area_mean` does it: it rounds its sums otherwise, so that photos, which came first, keep OpenCV's."""
    return isinstance(negative.picture, VideoFrame) and photo.shape[0] >= height and photo.shape[1] >= width


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

    cores = os.cpu_count() or 1
    if not any(isinstance(negative.picture, VideoFrame) for negative in negatives):

        def single(negative: Negative) -> Row:
            (photo,) = decoded([(negative.picture, negative.place)], channels)
            return develop(negative, photo)

        yield from _in_order(single, negatives, cores)
        return
    working = threading.BoundedSemaphore(cores)  # full-size pictures in floats are large: one a core
    threads = -(-cores // LANES)

    def lane(wanted: Sequence[Negative]) -> Iterator[Row]:
        fine = 4 * width > 3 * capture.views[wanted[0].view].camera.width
        pictures = decoded([(negative.picture, negative.place) for negative in wanted], channels, threads, fine)
        for negative, photo in zip(wanted, pictures, strict=True):
            with working:
                row = develop(negative, photo)
            yield row

    videos = [list(group) for _, group in itertools.groupby(negatives, lambda negative: negative.view)]
    for start in range(0, len(videos), LANES):
        yield from _in_turn([lane(wanted) for wanted in videos[start : start + LANES]])


@lru_cache(maxsize=LANES)
def _maps(lens: Lens, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """`Lens.maps`, kept while the frames of a camera are read."""
    return lens.maps(width, height)


def _in_order(function: Callable[[Negative], T], items: Sequence[Negative], cores: int) -> Iterator[T]:
    """`map` on several threads, in order, two items a core ahead."""
    with ThreadPoolExecutor(cores) as pool:
        waiting: deque[Future[T]] = deque()
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > 2 * cores:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def _in_turn(lanes: Sequence[Iterator[T]]) -> Iterator[T]:
    """One item of each lane in turn until all are at their end, each lane on its own thread."""
    pools = [ThreadPoolExecutor(1) for _ in lanes]
    running = [
        (pool, lane, deque(pool.submit(next, lane, None) for _ in range(_AHEAD)))
        for pool, lane in zip(pools, lanes, strict=True)
    ]
    try:
        while running:
            for one in list(running):
                pool, lane, ahead = one
                item = ahead.popleft().result()
                if item is None:
                    running.remove(one)
                    continue
                ahead.append(pool.submit(next, lane, None))
                yield item
    finally:
        for pool in pools:
            pool.shutdown(cancel_futures=True)
