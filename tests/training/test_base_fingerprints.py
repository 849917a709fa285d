"""A base of segments is fitted anew when anything changes that it was fitted to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import write_frames
from facefolds_core.training.segments.base import digests_of_frames, fingerprint_of_base
from tests.scenes import make_scene

SIZE = 16


def _fingerprint(scene: Scene) -> str:
    return fingerprint_of_base(scene, b"", [0], digests_of_frames(scene, range(scene.num_frames)))


def _store(scene: Scene, name: str, camera: int, channels: int) -> None:
    write_frames(
        scene.folder / name, (SIZE, SIZE, channels), [(camera, 0, np.full((SIZE, SIZE, channels), 9, np.uint8))]
    )


@pytest.mark.parametrize(("name", "channels"), [("mattes.arrow", 1), ("plates.arrow", 3)])
def test_the_camera_of_a_matte_or_a_plate_and_the_radius_count(tmp_path: Path, name: str, channels: int) -> None:
    scene = make_scene(tmp_path, size=SIZE)
    found = [_fingerprint(scene)]
    for camera in (0, 1):
        _store(scene, name, camera, channels)
        found.append(_fingerprint(scene))
    assert len(set(found)) == 3
    assert _fingerprint(replace(scene, radius=0.3)) != _fingerprint(scene) == found[-1]
