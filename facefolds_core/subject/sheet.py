"""The cut-outs to look at: one PNG."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.subject.mattes import Key, Matte

Image = NDArray[np.uint8]

GREEN, RED, WHITE = (90, 200, 90), (230, 40, 40), (255, 255, 255)
"""RGB: behind the subject, around what contradicts the others, of names."""
SIDE = 240
"""Longer side of a picture, pixels."""
MOST = 60
"""Pictures on the sheet, spread evenly."""


def contact_sheet(tiles: Sequence[Image]) -> Image:
    """(H, W, 3): tiles (h, w, 3) side by side and below each other."""
    height, width = tiles[0].shape[:2]
    across = math.ceil(math.sqrt(1.5 * len(tiles) * height / width))
    whole = [*tiles, *([np.full_like(tiles[0], WHITE)] * (-len(tiles) % across))]
    return np.vstack([np.hstack(whole[k : k + across]) for k in range(0, len(whole), across)])


def tile(scene: Scene, key: Key, picture: Image, matte: Matte) -> Image:
    """(h, w, 3): the cut-out over green, with camera and frame; in a red frame where the picture was not believed."""
    height, width = picture.shape[:2]
    scale = SIDE / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    opacity = matte.opacity[..., None] / np.float32(255)
    image = (picture * opacity + np.array(GREEN) * (1 - opacity)).astype(np.uint8)
    canvas = np.ascontiguousarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    words = f"{scene.cameras[key[0]].name} {scene.frame_ids[key[1]]} {matte.source}"
    words += "" if matte.agreement is None else f" {matte.agreement:.2f}"
    cv2.putText(canvas, words, (4, size[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.33, WHITE, 1, cv2.LINE_AA)
    if matte.source == "gaussians":
        cv2.rectangle(canvas, (1, 1), (size[0] - 2, size[1] - 2), RED, 3)
    return np.asarray(canvas, np.uint8)
