"""The cut-outs to look at: one PNG."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.spacing import spread
from facefolds_core.training.mattes.find import CutOut

Image = NDArray[np.uint8]

GREEN, RED, WHITE = (90, 200, 90), (230, 40, 40), (255, 255, 255)
"""RGB: behind the subject, around what is outvoted, of names."""
SIDE = 240
"""Longer side of a picture, pixels."""
MOST = 60
"""Pictures on the sheet, spread evenly."""


def contact_sheet(scene: Scene, found: Sequence[CutOut]) -> Image:
    """(H, W, 3): each cut-out over green, outvoted ones first, in red frames; with camera and frame."""
    chosen = spread(sorted(found, key=lambda one: one.believed), MOST)
    tiles = [_tile(scene, one) for one in chosen]
    height, width = tiles[0].shape[:2]
    across = math.ceil(math.sqrt(1.5 * len(tiles) * height / width))
    tiles += [np.full_like(tiles[0], WHITE)] * (-len(tiles) % across)
    return np.vstack([np.hstack(tiles[k : k + across]) for k in range(0, len(tiles), across)])


def _tile(scene: Scene, one: CutOut) -> Image:
    height, width = one.matte.shape
    scale = SIDE / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    matte = one.matte[..., None] / np.float32(255)
    image = one.image * matte + np.array(GREEN) * (1 - matte)
    small = cv2.resize(image.astype(np.uint8), size, interpolation=cv2.INTER_AREA)
    canvas = np.ascontiguousarray(small)
    words = f"{scene.cameras[one.camera].name} {scene.frame_ids[one.frame]} {one.source}"
    words += "" if one.agreement is None else f" {one.agreement:.2f}"
    cv2.putText(canvas, words, (4, size[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.33, WHITE, 1, cv2.LINE_AA)
    if not one.believed:
        cv2.rectangle(canvas, (1, 1), (size[0] - 2, size[1] - 2), RED, 3)
    return np.asarray(canvas, np.uint8)
