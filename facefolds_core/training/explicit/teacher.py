"""Views that nobody filmed: the subject's Gaussians, seen from between the cameras.

Few photos do not say what layers look like from between them: each camera can be shown a picture of its own. Gaussians
have no such freedom, and what they show from there is nearer to the truth (docs/research/few-cameras.md). So where few
cameras look, their pictures are targets beside the photos, in each frame. The Gaussians of frames that differ also say
how far the surface moves, and so how far apart the layers must lie.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.subject.drawing import draw, view_of
from facefolds_core.subject.found import reference_frame
from facefolds_core.subject.frames import changed_to, mean_errors, ridden, targets_of
from facefolds_core.subject.splats import Splats
from facefolds_core.subject.standing import in_part
from facefolds_core.subject.storage import FoundSubject
from facefolds_core.subject.virtual import seen_by_few, virtual_cameras
from facefolds_core.training.likeness import comparable, farthest_first, likenesses

Image = NDArray[np.uint8]

MIN_START_PSNR = 25.0
"""Least PSNR of the subject's Gaussians over the training pictures, dB, from which on they are believed."""

OTHERS = 2
"""Frames beside that of the start in which it is looked where the surface lies."""


@dataclass(frozen=True)
class Virtual:
    """Cameras that nobody filmed with.

    Attributes:
        cameras: V of them, in the head's own frame.
        mattes: (V, H, W) of the subject in the frame of the start.
        wanted: (V, H, W) which of their pixels are asked for.
        apart: one of so many of these is looked at, so that they count no more than the photos.
    """

    cameras: tuple[Camera, ...]
    mattes: Image
    wanted: NDArray[np.bool_]
    apart: int


class Teacher:
    """Pictures of the virtual cameras in any frame.

    Args:
        scene: with training cameras.
        found: its subject, in the frame of the start. Gaussians that explain the photos with less than
            `MIN_START_PSNR` teach nothing: there are no virtual cameras then.
        seed: of the draws of the other frames' Gaussians.
    """

    def __init__(self, scene: Scene, found: FoundSubject, seed: int) -> None:
        splats = found.splats
        self._scene, self._splats, self._seed = scene, splats, seed
        self._first = reference_frame(scene)
        self._usual: NDArray[np.float32] | None = None
        self._known = {self._first: splats}
        self._mesh: NDArray[np.float32] | None = None
        self._torso = found.torso
        real = self._real(self._first)
        self._believed = found.psnr >= MIN_START_PSNR
        cameras = virtual_cameras(real, splats, (scene.width, scene.height)) if self._believed else ()
        self._views = [view_of(camera) for camera in cameras]
        mattes = self._drawn(splats)[..., 3].reshape(len(cameras), scene.height, scene.width)
        wanted = seen_by_few(cameras, real, splats).reshape(mattes.shape)
        photos = max(1, len(real) * scene.height * scene.width)
        self.virtual = Virtual(cameras, mattes, wanted, max(1, math.ceil(wanted.sum() / photos)))

    def others(self, photos: Callable[[int], Image]) -> list[Splats]:
        """The Gaussians of the `OTHERS` frames that look least like that of the start and one another. From then on it
        is known whether Gaussians ride on the tracked mesh.

        Args:
            photos: as of `cut`.
        """
        if not self._believed or self._scene.num_frames == 1:
            return []
        chosen = farthest_first(comparable(likenesses(self._scene)), 1 + OTHERS, self._first)
        others = [frame for frame in chosen if frame != self._first]
        if not others:
            return []
        surface = self._scene.load_surface()
        if surface is not None and all(self._rides(surface[0], frame, photos) for frame in others):
            self._mesh = surface[0]
        return [self._at(frame, photos) for frame in others]

    def moved(self, frame: int) -> Splats | None:
        """The Gaussians of a frame as the tracked mesh says; None where there is none, or they are the start's."""
        return None if frame == self._first or self._mesh is None else self._ridden(self._mesh, frame)

    def cut(self, frame: int, photos: Callable[[int], Image]) -> Image:
        """(V, H W, 4) RGBA of a frame, colours times opacity.

        Args:
            photos: frame -> (C, H W, 4) cut-outs of the training cameras.
        """
        return self._drawn(self._at(frame, photos) if self._views else self._splats)

    def _at(self, frame: int, photos: Callable[[int], Image]) -> Splats:
        """The Gaussians of a frame, as the layers hold them: a torso that stays in the room is where it was made. They
        are kept, since pictures may be asked for again."""
        if frame not in self._known:
            if self._usual is None:
                shown = in_part(self._splats, *self._turned(self._first))  # of a part of a take the pose is another
                self._usual = mean_errors(shown, targets_of(self._real(self._first), photos(self._first)))
            targets = targets_of(self._real(frame), photos(frame))
            moved, (stays, shift) = self.moved(frame), self._turned(frame)
            turned = in_part(self._splats if moved is None else moved, stays, shift)
            changed = changed_to(turned, self._usual, targets, self._seed + frame)
            self._known[frame] = in_part(changed, stays, shift.inverse())
        return self._known[frame]

    def _turned(self, frame: int) -> tuple[NDArray[np.bool_], Similarity]:
        """(N,) which Gaussians stay in the room, and how these move in the head's own frame."""
        poses, torso = self._scene.poses, self._torso
        if poses is None or torso is None:
            return np.zeros(len(self._splats), bool), Similarity.identity()
        return torso.share(self._splats.means) > 0.5, torso.shift(poses.at(frame))

    def _ridden(self, mesh: NDArray[np.float32], frame: int) -> Splats:
        start, now = (mesh[k].astype(np.float64) for k in (self._first, frame))
        moved, (stays, _) = ridden(self._splats, start, now), self._turned(frame)
        return replace(moved, values=np.where(stays[:, None], self._splats.values, moved.values))

    def _rides(self, mesh: NDArray[np.float32], frame: int, photos: Callable[[int], Image]) -> bool:
        """Whether Gaussians that ride on the mesh (K, V, 3) explain the photos of a frame better."""
        targets = targets_of(self._real(frame), photos(frame))
        stays, shift = self._turned(frame)
        both = (in_part(one, stays, shift) for one in (self._splats, self._ridden(mesh, frame)))
        still, riding = (mean_errors(one, targets).mean() for one in both)
        return bool(riding < still)

    def _real(self, frame: int) -> list[Camera]:
        return [self._scene.camera_in_head(i, frame) for i in self._scene.indices("train")]

    def _drawn(self, splats: Splats) -> Image:
        found = np.zeros((len(self._views), self._scene.height * self._scene.width, 4), np.uint8)
        for view, own in zip(self._views, found, strict=True):
            rgb, light = draw(splats.values, view).picture()
            rgba = np.concatenate([rgb, 1 - light[..., None]], -1)
            own[:] = np.rint(255 * rgba.clip(0, 1)).reshape(-1, 4)
        return found
