"""Some frames of a scene, as a scene of their own: what is trained at once of a take that is too long for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.track import Track


@dataclass(frozen=True)
class ScenePart(Scene):
    """Frames `chosen` of the scene `whole`, numbered from 0 on; cameras, plates and sound are the scene's."""

    whole: Scene | None = None
    chosen: tuple[int, ...] = ()

    def stored(self, path: Path) -> FrameStore | None:
        store = super().stored(path)
        return None if store is None else store.part(self.chosen)

    def open_frames(self) -> FrameStore:
        return super().open_frames().part(self.chosen)

    def load_surface(self) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        surface = None if self.whole is None else self.whole.load_surface()
        return None if surface is None else (surface[0][list(self.chosen)], surface[1])


def part_of(scene: Scene, frames: Sequence[int]) -> ScenePart:
    """Some frames of a scene, in this order."""
    chosen, poses = list(frames), scene.poses
    values = {
        **{one.name: getattr(scene, one.name) for one in fields(Scene)},
        "frame_ids": tuple(scene.frame_ids[k] for k in chosen),
        "times": scene.times[chosen],
        "poses": None if poses is None else Track(poses.quaternions[chosen], poses.translations[chosen], poses.torso),
    }
    return ScenePart(**values, whole=scene, chosen=tuple(chosen))
