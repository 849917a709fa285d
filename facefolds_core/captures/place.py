"""Where a scene's subject is taken to be, drawn over its pictures: `place.png` of the scene's folder.

A wrong centre, front or scale shows here at a glance, before minutes of training."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from facefolds_core.captures.scene import REACH, Scene
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.spacing import spread

Image = NDArray[np.uint8]

MOST = 24
"""Cameras on the sheet, spread evenly over those of the scene."""
CELL = 240
"""Longer side of a picture on the sheet, pixels."""
AXIS = 0.12
"""Length of the axes, units: about a head's radius."""
POINTS = 90
"""Of the ball's outline."""
BALL, CENTRE = (255, 170, 0), (255, 255, 255)
AXES = ((230, 60, 60), (60, 200, 60), (80, 120, 255))
"""Colours (RGB): the subject's front, its left, up."""


def ball_outline(camera: Camera, radius: float) -> NDArray[np.float64]:
    """(POINTS, 2) pixels of the outline of the ball about the origin: where rays touch it. The camera stands outside.

    They touch it in a circle around the point radius^2 / d from the centre towards the camera, d its distance."""
    towards = camera.centre
    d = float(np.linalg.norm(towards))
    axis = towards / d
    across = np.linalg.svd(axis[None])[2][1:]  # two unit vectors across it
    turn = np.linspace(0, 2 * math.pi, POINTS, endpoint=False)
    circle = np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]
    points = axis * radius**2 / d + circle * radius * math.sqrt(max(0.0, 1 - (radius / d) ** 2))
    return camera.project(points)[0]


def draw_place(path: Path, scene: Scene, frames: FrameStore) -> None:
    """The ball, the centre and the axes (red: the subject's front, green: its left, blue: up) over the first frame."""
    there = [i for i in range(len(scene.cameras)) if (i, 0) in frames]
    chosen = spread(there, MOST)
    radius = REACH if scene.radius is None else scene.radius
    cells = [_cell(scene.cameras[i], frames.image(i, 0), radius) for i in chosen]
    Pillow.fromarray(contact_sheet(cells)).save(path)


def contact_sheet(tiles: Sequence[Image]) -> Image:
    """(H, W, 3): tiles (h, w, 3) side by side and below each other."""
    height, width = tiles[0].shape[:2]
    across = math.ceil(math.sqrt(1.5 * len(tiles) * height / width))
    whole = [*tiles, *([np.full_like(tiles[0], 255)] * (-len(tiles) % across))]
    return np.vstack([np.hstack(whole[k : k + across]) for k in range(0, len(whole), across)])


def _cell(camera: Camera, image: Image, radius: float) -> Image:
    scale = CELL / max(camera.width, camera.height)
    small = camera.resized(max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))
    canvas = np.ascontiguousarray(cv2.resize(image, (small.width, small.height), interpolation=cv2.INTER_AREA))
    if np.linalg.norm(camera.centre) > radius:
        cv2.polylines(canvas, [_drawable(ball_outline(small, radius))], True, BALL, 1, cv2.LINE_AA)
    places, depth = small.project(np.concatenate([np.zeros((1, 3)), AXIS * np.eye(3)]))
    if (depth > 0).all():
        origin, *ends = _drawable(places)
        for end, colour in zip(ends, AXES, strict=True):
            cv2.line(canvas, origin.tolist(), end.tolist(), colour, 1, cv2.LINE_AA)
        cv2.circle(canvas, origin.tolist(), 2, CENTRE, -1, cv2.LINE_AA)
    cv2.putText(canvas, camera.name, (4, small.height - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.35, CENTRE, 1, cv2.LINE_AA)
    return np.asarray(canvas, np.uint8)


def _drawable(places: NDArray[np.float64]) -> NDArray[np.int32]:
    """Whole pixels, bounded: OpenCV has 16 bits for those beyond the picture."""
    whole: NDArray[np.int32] = np.rint(places.clip(-10_000, 10_000)).astype(np.int32)
    return whole
