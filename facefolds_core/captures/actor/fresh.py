"""Pictures of the embedded actor that no camera of its capture has taken: truth that costs seconds only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.capture import frame_name, frame_times, options_of
from facefolds_core.captures.actor.render import render
from facefolds_core.captures.actor.rig import camera_at, new_views
from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams


@dataclass(frozen=True)
class FreshView:
    """A new picture of a frame that the scene has.

    Attributes:
        camera: in the scene's coordinates, of its size.
        azimuth, elevation: of the camera, degrees, in the head's frame.
        frame: index in the scene.
        rgb: (H, W, 3) uint8.
        opacity: (H, W) of the subject, in [0, 1].
    """

    camera: Camera
    azimuth: float
    elevation: float
    frame: int
    rgb: NDArray[np.uint8]
    opacity: NDArray[np.float64]


def film_fresh_views(scene: Scene, params: CaptureParams, count: int) -> Iterator[FreshView]:
    """`count` views all over the rig, each of one frame, the frames in turn."""
    times = {frame_name(k): float(time) for k, time in enumerate(frame_times(params))}
    for i, (azimuth, elevation) in enumerate(new_views(count)):
        frame = i % scene.num_frames
        camera = camera_at(f"fresh{i:03d}", azimuth, elevation, scene.width, scene.height)
        picture = render(camera, times[scene.frame_ids[frame]], options_of(params))
        moved = camera.transformed(scene.from_capture)
        yield FreshView(moved, azimuth, elevation, frame, picture.rgb, picture.opacity.astype(np.float64))
