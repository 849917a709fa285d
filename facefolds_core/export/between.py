"""Texture frames between those of the capture, for assets at two or three times its frame rate.

A mixture of two frames shows what moves twice, half transparent. Here texels follow the motion. All layers share one
map of directions from c, so one motion serves them all: it is measured on the layers composited from the outermost in,
with dense optical flow between neighbouring frames (Kroeger, Timofte, Dai, Van Gool 2016, "Fast Optical Flow using
Dense Inverse Search").

With the flow F from frame k to k + 1, a texel x of frame k is at x + t F(x) at the time k + t. The one that is at y
then is found by the fixed point x = y - t F(x); likewise from frame k + 1, with the flow back and 1 - t. Both frames
are read there, bilinear in premultiplied alpha, and mixed. The nearer one in time weighs more, and so does the one of
which more texels crowd at y: where something comes into sight (an opening mouth), the frame before has nothing and is
stretched over the gap, the frame after shows it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.export.textures import premultiply, straight
from facefolds_core.frame_store import FrameStore, write_frames
from facefolds_core.params import BetweenParams
from facefolds_core.progress import progress as progress_bar

GREY = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue: BT.601's."""

_USUAL = BetweenParams()

Image = NDArray[np.uint8]
Float = NDArray[np.float32]


@dataclass(frozen=True)
class Motion:
    """Flow between frames k and k + 1: the texel (column, row) x of one is found at x + flow(x) in the other.

    Attributes:
        forward: (S, S, 2) float32, texels, from k to k + 1.
        backward: (S, S, 2), from k + 1 to k.
    """

    forward: Float
    backward: Float
    params: BetweenParams = _USUAL

    @classmethod
    def between(cls, first: Image, second: Image, params: BetweenParams) -> Motion:
        """Of two pictures (S, S) uint8."""
        least = params.min_side
        return cls(dense_flow(first, second, least), dense_flow(second, first, least), params)

    def at(self, t: float) -> Moved:
        """How to make the frame at k + t, 0 < t < 1."""
        steps, least = self.params.fixed_point_steps, self.params.min_crowd
        first, second = sources(t * self.forward, steps), sources((1 - t) * self.backward, steps)
        weight, other = (1 - t) * crowd(first, least), t * crowd(second, least)
        return Moved(first, second, np.asarray(other / (weight + other), np.float32)[..., None])


@dataclass(frozen=True)
class Moved:
    """Where the texels of a frame between two come from.

    Attributes:
        first, second: (S, S, 2) columns and rows in the frame before and in the one after.
        share: (S, S, 1) weight of the frame after, in [0, 1].
    """

    first: Float
    second: Float
    share: Float

    def image(self, before: Image, after: Image) -> Image:
        """The texture of one layer, from those before and after, all (S, S, 4) uint8 with straight alpha."""
        one, other = look_up(premultiply(before), self.first), look_up(premultiply(after), self.second)
        return straight(one + self.share * (other - one))


def dense_flow(first: Image, second: Image, min_side: int = _USUAL.min_side) -> Float:
    """(S, S, 2) float32: where the texels of `first` went. 0 for small pictures, and where the flow is not finite.

    Args:
        first, second: (S, S) uint8.
    """
    if min(first.shape) < min_side:
        return np.zeros((*first.shape, 2), np.float32)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)  # the result depends on how many share the picture
    try:
        method = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
        flow = method.calc(first, second, None)  # type: ignore[call-overload]  # None: no flow to start from
    finally:
        cv2.setNumThreads(threads)
    return np.where(np.isfinite(flow).all(-1, keepdims=True), flow, np.float32(0))


def sources(displacement: Float, steps: int = _USUAL.fixed_point_steps) -> Float:
    """(S, S, 2) columns and rows: which texel x of a frame is at each y = x + displacement(x)."""
    rows, columns = np.mgrid[: displacement.shape[0], : displacement.shape[1]].astype(np.float32)
    grid = np.stack([columns, rows], -1)
    found = grid - displacement
    for _ in range(steps):
        found = grid - look_up(displacement, found)
    return found


def crowd(places: Float, least: float = _USUAL.min_crowd) -> Float:
    """(S, S) float32 > 0: texels of the frame a texel, from where they come from; 1 where nothing is stretched."""
    (down_x, right_x), (down_y, right_y) = (np.gradient(places[..., axis]) for axis in (0, 1))
    density = np.abs(right_x * down_y - down_x * right_y)
    return np.asarray(cv2.GaussianBlur(density, (0, 0), 1.0) + least, np.float32)


def look_up(image: Float, at: Float) -> Float:
    """Bilinear, clamped to the border: image (S, S, C) at (columns, rows) (S, S, 2)."""
    found = cv2.remap(image, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, np.float32)


def picture(store: FrameStore, layers: int, frame: int, behind: float = _USUAL.behind) -> Image:
    """(S, S) uint8: all layers of a frame, composited from the outermost in, over grey."""
    seen = np.zeros((store.height, store.width, 3), np.float32)
    through = np.ones((store.height, store.width, 1), np.float32)
    for layer in range(layers):
        texture = premultiply(store.image(layer, frame))
        seen += through * texture[..., :3]
        through *= 1 - texture[..., 3:]
    grey = seen @ GREY + np.float32(behind) * through[..., 0]
    return np.asarray(np.rint(grey * 255).clip(0, 255), np.uint8)


def motions(store: FrameStore, layers: int, frames: int, params: BetweenParams = _USUAL) -> Iterator[Motion]:
    """From each frame to the next: frames - 1 of them, with two pictures in memory."""
    last = picture(store, layers, 0, params.behind)
    for frame in range(1, frames):
        here = picture(store, layers, frame, params.behind)
        yield Motion.between(last, here, params)
        last = here


def between_rows(
    store: FrameStore, factor: int, params: BetweenParams = _USUAL, progress: bool = True
) -> Iterator[tuple[int, int, Image]]:
    """All textures at `factor` times the frame rate, one at a time: frame by frame, layers from the outermost in.

    Frame k of the store is frame k * factor, as it was. After the last one nothing is known: it is held, so that the
    sequence lasts as long as before.

    Args:
        store: layered frame store (camera := layer), complete.
        factor: at least 1.

    Yields:
        (layer, frame, (S, S, 4) uint8).
    """
    layers, frames = (1 + max(key[i] for key in store.keys()) for i in (0, 1))  # noqa: SIM118
    flows = motions(store, layers, frames, params)
    for frame in progress_bar(range(frames), desc="between", unit="frame", disable=not progress):
        motion = next(flows, None)
        for step in range(factor):
            moved = None if step == 0 or motion is None else motion.at(step / factor)
            for layer in range(layers):
                image = store.image(layer, frame)
                if moved is not None:
                    image = moved.image(image, store.image(layer, frame + 1))
                yield layer, frame * factor + step, image


@contextmanager
def at_frame_rate(store: FrameStore, factor: int, folder: Path, params: BetweenParams = _USUAL) -> Iterator[FrameStore]:
    """The store of `between_rows`, in a file in `folder` that is gone afterwards; of a factor of 1 the store itself."""
    if factor == 1:
        yield store
        return
    with TemporaryDirectory(dir=folder, prefix=".between-") as scratch:
        path = Path(scratch) / "textures.arrow"
        rows = between_rows(store, factor, params)
        write_frames(path, (store.height, store.width, store.channels), rows, packed=True)
        yield FrameStore(path)
