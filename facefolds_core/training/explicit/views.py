"""The training views as rays with stored crossings: of a still head once, of a turning one in each frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radial_kernel import texture_positions
from facefolds_core.spacing import spread
from facefolds_core.system.spill import spill_folder, spilled_together
from facefolds_core.training.explicit.teacher import Virtual
from facefolds_core.training.rays import nothing_seen

Array = NDArray[np.float64]


FINER = 0.25 * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
"""(S, 2): where the rays of a pixel at an outline go through, pixels from its centre. An outline runs through such a
pixel; elsewhere one ray shows what four do."""


@dataclass(frozen=True)
class Views:
    """P pixels of C training cameras whose rays cross at least one layer; Q of them at outlines.

    Attributes:
        codes: (P, N, 2) uint16 (`hit_codes`): the crossing of the ray through the centre with each layer, over the
            window. A texel of 512 is 128 steps.
        finer: (Q, S, N, 2), of S rays spread over the pixel.
        which: (P,) int32, which of the Q it is, or -1.
        camera: (P,) int32, position in the list of training cameras.
        pixel: (P,) int32, row-major.
        directions: (P, 3) float32, unit vectors, through the centre.
    """

    codes: NDArray[np.uint16]
    finer: NDArray[np.uint16]
    which: NDArray[np.int32]
    camera: NDArray[np.int32]
    pixel: NDArray[np.int32]
    directions: NDArray[np.float32]

    @property
    def arrays(self) -> tuple[NDArray[np.uint16], NDArray[np.uint16], *tuple[NDArray[np.int32], ...]]:
        """Codes, finer, which, camera, pixel: as `shading_kernel.shade` takes them."""
        return self.codes, self.finer, self.which, self.camera, self.pixel

    def part(self, chosen: NDArray[np.integer]) -> Views:
        """Some of the pixels, copied."""
        which = self.which[chosen]
        there = which >= 0
        finer = self.finer[which[there]]
        which[there] = np.arange(len(finer))
        return Views(self.codes[chosen], finer, which, self.camera[chosen], self.pixel[chosen], self.directions[chosen])

    @staticmethod
    def together(parts: Sequence[Views]) -> Views:
        """One after the other."""
        before = np.cumsum([0, *(len(part.finer) for part in parts)])
        which = [np.where(part.which < 0, -1, part.which + k) for part, k in zip(parts, before, strict=False)]
        names = ("codes", "finer", "camera", "pixel", "directions")
        joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return Views(which=np.concatenate(which).astype(np.int32), **joined)


SOFT = 8
"""Codes of a matte between which it is the same: what differs more within 3 x 3 pixels is an outline."""
FRAMES = 12
"""In which outlines of a still head are looked for, at most."""


class Tracer:
    """Crosses pixels of training cameras with the layers."""

    def __init__(self, scene: Scene, manifolds: RadialManifolds, virtual: Virtual | None = None) -> None:
        self._scene, self._mattes, self._virtual = scene, scene.open_mattes(), virtual
        self._real = scene.indices("train")
        self.count = len(self._real) + (0 if virtual is None else len(virtual.cameras))
        self._centre = manifolds.centre.cpu().numpy().astype(np.float64)
        self._window, self._trace = np.array(manifolds.window), manifolds.tracer()
        self._belt, self._bend = manifolds.chart.numbers, manifolds.bend

    def views(self, position: int, first: int, stride: int, frames: Sequence[int], fine: bool) -> Views:
        """Every `stride`-th pixel from number `first` on, if its rays meet a layer; of virtual cameras fewer.

        Args:
            position: of the camera among the training cameras, then the virtual ones.
            frames: in which outlines count; the camera stands as in the first.
            fine: whether pixels at outlines have finer rays.
        """
        camera, pose = self._camera(position, frames[0]), self._pose(position, frames[0])
        pixels = self._pixels(position, first, stride)
        centres = np.stack([pixels % camera.width, pixels // camera.width], -1) + 0.5
        codes, directions = self._codes(camera, centres, pose)
        around = np.flatnonzero(self._outline(position, frames).ravel()[pixels]) if fine else np.zeros(0, np.int64)
        finer = np.stack([self._codes(camera, centres[around] + offset, pose)[0] for offset in FINER], 1)
        hit = np.asarray((codes[..., 0] > 0).any(1))
        hit[around] |= np.asarray((finer[..., 0] > 0).any((1, 2)))
        which = np.full(len(pixels), -1, np.int32)
        which[around] = np.arange(len(around))
        own = np.full(len(pixels), position, np.int32)
        along = directions.astype(np.float32)
        return Views(codes, finer, which, own, pixels.astype(np.int32), along).part(np.flatnonzero(hit))

    def _pixels(self, position: int, first: int, stride: int) -> NDArray[np.int64]:
        """Numbers of those that are looked at."""
        count = self._scene.height * self._scene.width
        if position < len(self._real) or self._virtual is None:
            return np.arange(first, count, stride)
        pixels = np.arange(first, count, stride * self._virtual.apart)
        wanted = self._virtual.wanted[position - len(self._real)].ravel()
        return np.asarray(pixels[wanted[pixels]])

    def _codes(
        self, camera: Camera, places: NDArray[np.floating], pose: Similarity | None
    ) -> tuple[NDArray[np.uint16], Array]:
        """(R, N, 2) of rays through places (R, 2), and their directions (R, 3)."""
        origins, directions = camera.rays(places.astype(np.float64))
        offsets, directions = np.ascontiguousarray(origins - self._centre), np.ascontiguousarray(directions)
        bend = self._bend(pose)
        distance = self._trace(offsets, directions, bend)
        return texture_positions(offsets, directions, distance, self._window, self._belt, bend), directions

    def _pose(self, position: int, frame: int) -> Similarity | None:
        """In which a camera sees the head turned over the torso; virtual ones see the layers as they were made."""
        poses = self._scene.poses
        return None if poses is None or position >= len(self._real) else poses.at(frame)

    def _camera(self, position: int, frame: int) -> Camera:
        if position < len(self._real):
            return self._scene.camera_in_head(self._real[position], frame)
        assert self._virtual is not None
        return self._virtual.cameras[position - len(self._real)]

    def _outline(self, position: int, frames: Sequence[int]) -> NDArray[np.bool_]:
        """(H, W) pixels around which a matte of one of the frames is not the same."""
        found, near = np.zeros((self._scene.height, self._scene.width), bool), np.ones((3, 3), np.uint8)
        for matte in self._known_mattes(position, frames):
            found |= cv2.dilate(matte, near).astype(int) - cv2.erode(matte, near) > SOFT
        return found

    def _known_mattes(self, position: int, frames: Sequence[int]) -> Iterator[NDArray[np.uint8]]:
        if position >= len(self._real):
            assert self._virtual is not None
            yield self._virtual.mattes[position - len(self._real)]
        elif self._mattes is not None:
            keys = [(self._real[position], frame) for frame in frames]
            yield from (self._mattes.image(*key)[..., 0] for key in keys if key in self._mattes)


def trace_views(scene: Scene, manifolds: RadialManifolds, stride: int, virtual: Virtual | None = None) -> Views:
    """Cross every `stride`-th pixel of each training camera (a different set in each) with the layers, and fewer of the
    virtual cameras.

    Raises:
        UserError: if no ray of any camera crosses a layer.
    """
    tracer, frames = Tracer(scene, manifolds, virtual), spread(range(scene.num_frames), FRAMES)
    cameras = range(tracer.count)
    views = Views.together([tracer.views(k, first_pixel(k, stride), stride, frames, stride == 1) for k in cameras])
    if len(views.pixel) == 0:
        raise nothing_seen(scene)
    return views


def check_images(scene: Scene) -> None:
    """Refuse a scene in which a training camera lacks a frame: steps look at a frame by all of them.

    Raises:
        UserError: naming the camera and the frame.
    """
    store = scene.open_frames()
    for camera in scene.indices("train"):
        for frame in range(scene.num_frames):
            if (camera, frame) not in store:
                raise UserError(
                    "a training image is missing",
                    file=store.path,
                    place=f"camera {scene.cameras[camera].name}, frame {scene.frame_ids[frame]}",
                    expected="every frame of every camera: the explicit model is trained with all of them at once",
                    remedy="run `dvc repro` to make the normalised scene again",
                )


class RaySource(Protocol):
    """The rays of all training cameras in any frame.

    Attributes:
        count: of them that cross at least one layer, in a frame.
    """

    @property
    def count(self) -> int: ...

    def part(self, frame: int, phase: int, parts: int) -> tuple[Views, NDArray[np.int64]]:
        """One of `parts` shares of the rays of a frame: views, and which of their rays."""
        ...

    def in_use(self, frame: int) -> Iterator[Views]:
        """All rays of a frame that steps take."""
        ...


@dataclass(frozen=True)
class StillRays:
    """Of a head that stands still: the same in all frames."""

    views: Views

    @property
    def count(self) -> int:
        return len(self.views.pixel)

    def part(self, frame: int, phase: int, parts: int) -> tuple[Views, NDArray[np.int64]]:
        return self.views, np.arange(phase, self.count, parts)

    def in_use(self, frame: int) -> Iterator[Views]:
        """See `RaySource`."""
        yield self.views


SHARES = 3
"""Of the rays of a turning head's frame that are traced, each as large as a step takes."""
SAMPLE, SAMPLED_FRAMES = 64, 6
"""One ray in so many, in so many frames, is looked at to estimate how many meet the subject."""
RESERVE = 4 << 30
"""Bytes that stay free where traced rays are kept in temporary files. 18 frames of 500 x 768 by 22
cameras have 10 GB of them, and to trace one takes ten times as long as a step on it."""


class MovingRays:
    """Of a head that turns: the cameras stand elsewhere in its own frame in each frame, so that each has crossings of
    its own. They are traced in shares when they are asked for, and kept in temporary files while there is room.

    Args:
        scene: with poses.
        manifolds: the layers; later changes of them are not seen.
        stride: of the pixels that there are, as in `trace_views`.
        share: rays of a share: as many as a step at the finest resolution of these layers takes.
        first: number of the first share of frame 0.
        shares, sample, reserve: see `SHARES`, `SAMPLE` and `RESERVE`.
    """

    def __init__(
        self,
        scene: Scene,
        manifolds: RadialManifolds,
        stride: int,
        share: float,
        first: int = 0,
        virtual: Virtual | None = None,
        shares: int = SHARES,
        sample: int = SAMPLE,
        reserve: float = RESERVE,
    ) -> None:
        self._first, self._stride = first, stride
        self._tracer = Tracer(scene, manifolds, virtual)
        self._kept: dict[tuple[int, int], Views] = {}
        self._reserve, self._told = reserve, False
        frames = spread(range(scene.num_frames), SAMPLED_FRAMES)
        found = [len(self._traced(k, 0, sample).pixel) for k in frames]
        self.count = sample * sum(found) // len(found)
        if self.count == 0:
            raise nothing_seen(scene)
        self.shares = max(1, int(self.count / share))
        self._used = min(self.shares, shares)

    def part(self, frame: int, phase: int, parts: int) -> tuple[Views, NDArray[np.int64]]:
        """See `RaySource`. Of the shares of a frame only some are in use, in each frame others."""
        turn, rest = phase % self._used, phase // self._used
        number = (self._first + frame * self._used + turn) % self.shares
        views = self._kept.get((frame, number))
        if views is None:
            views = self._keep((frame, number), self._traced(frame, number, self.shares))
        finer = max(1, round(parts / self.shares))
        return views, np.arange(rest % finer, len(views.pixel), finer)

    def _keep(self, key: tuple[int, int], views: Views) -> Views:
        """The same in a temporary file, which the system holds in memory as far as it has some."""
        kept = spilled_together(vars(views), self._reserve)
        if kept is not None:
            views = self._kept[key] = Views(**kept)
        elif not self._told:
            self._told = True
            tqdm.write(
                f"train: no room for traced rays in {spill_folder()}: they are traced again and again, which takes "
                "several times as long; TMPDIR names another folder"
            )
        return views

    def in_use(self, frame: int) -> Iterator[Views]:
        """See `RaySource`; share by share."""
        for turn in range(self._used):
            yield self.part(frame, turn, 1)[0]

    def _traced(self, frame: int, phase: int, parts: int) -> Views:
        """Every `parts`-th of the pixels that there are, from number `phase` on."""
        stride, tracer = self._stride, self._tracer
        firsts = [first_pixel(k, stride) + stride * phase for k in range(tracer.count)]
        found = [tracer.views(k, own, stride * parts, [frame], stride == 1) for k, own in enumerate(firsts)]
        return Views.together(found)


def first_pixel(camera: int, stride: int) -> int:
    """Where every `stride`-th pixel of a camera begins: another one in each of up to `stride` cameras."""
    return camera * (7 if stride % 7 else 5) % stride
