"""Mattes of many pictures from the Gaussians of one frame: those say roughly where the subject is, each picture says it
to the pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.params import OutlineParams
from facefolds_core.subject.fit import fit_start
from facefolds_core.subject.found import background, opacity_of
from facefolds_core.subject.mattes import Array, Bool, EdgeParams, cut_out, find_subject, softened
from facefolds_core.training.mattes.find import CutOut, Key, small

AGREEING = 0.7
"""IoU of a cut-out with what the Gaussians say, in shares of the median picture's, under which it is not believed."""


@dataclass(frozen=True)
class _Seen:
    """(H, W) opacity of the subject's Gaussians and (H, W, 3) what stands behind them, from one camera."""

    opacity: Array
    behind: Array


def from_gaussians(scene: Scene, pictures: Sequence[Key], params: OutlineParams, bar: tqdm) -> list[CutOut]:
    """Mattes of some (camera, frame), by the Gaussians of the scene's middle frame.

    Args:
        bar: advanced by one a picture.
    """
    frame, edge, store = scene.num_frames // 2, EdgeParams(), scene.open_frames()
    splats = fit_start(scene, frame)
    subject = find_subject(scene, splats, frame, edge).subject
    seen: dict[Key, _Seen] = {}
    found, agreement = [], []
    for key in pictures:
        camera, of = scene.camera_in_head(*key), key if scene.poses is not None else (key[0], 0)
        if of not in seen:
            seen = {} if scene.poses is not None else seen
            seen[of] = _Seen(opacity_of(splats, subject, camera), background(splats, subject, camera))
        picture = store.image(*key)
        cut = cut_out(picture, seen[of].opacity, camera, edge)
        matte = softened(picture, cut, seen[of].opacity, seen[of].behind, camera, edge)
        agreement.append(_iou(cut, seen[of].opacity > 0.5))
        found.append((key, matte))
        bar.update()
    least = AGREEING * float(np.median(agreement)) if agreement else 0.0
    return [
        _made(scene, key, matte, share, share >= least, params)
        for (key, matte), share in zip(found, agreement, strict=True)
    ]


def _made(scene: Scene, key: Key, matte: Array, share: float, believed: bool, params: OutlineParams) -> CutOut:
    image = small(scene, scene.open_frames().image(*key), params)
    opacity = cv2.resize(np.asarray(matte, np.float32), image.shape[1::-1], interpolation=cv2.INTER_AREA)
    return CutOut(*key, image, np.rint(255 * opacity.clip(0, 1)).astype(np.uint8), "picture", share, believed)


def _iou(one: Bool, other: Bool) -> float:
    union = int((one | other).sum())
    return int((one & other).sum()) / union if union else 1.0
