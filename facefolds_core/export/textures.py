"""Texture frames from the sampled R x R to the shipped R^t x R^t.

Filtering happens in premultiplied alpha, so that what a transparent texel happens to hold never bleeds into its
neighbours; then colours are divided by alpha again. Texels with alpha 0 get the colour of their surroundings, because a
player interpolates colour and alpha apart, and because the video codec spends no bits on smooth colour.
"""

from __future__ import annotations

from functools import lru_cache, partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.inputs import check_textures
from facefolds_core.export.bilinear import Projection
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.progress import progress
from facefolds_core.system.threads import in_order

Float = NDArray[np.float32]
Image = NDArray[np.uint8]


def resample(image: Image, size: int) -> Image:
    """One texture to `size` x `size` texels: least squares when shrinking (`bilinear`), bilinear when enlarging.

    Args:
        image: (R, R, 4) uint8 RGBA, straight alpha.

    Returns:
        (size, size, 4) uint8 RGBA, straight alpha, no alpha-0 texel without a colour (unless all are).
    """
    premultiplied = premultiply(image)
    if size != len(image):
        if size < len(image):
            premultiplied = _shrinking(len(image), size)(premultiplied)
        else:
            enlarged = cv2.resize(premultiplied, (size, size), interpolation=cv2.INTER_LINEAR)
            premultiplied = np.asarray(enlarged, np.float32)
    result = straight(premultiplied)
    if size == len(image):  # exactly what was there, where it shows
        shown = result[..., 3] > 0
        result[shown] = image[shown]
    return result


@lru_cache(maxsize=8)
def _shrinking(source: int, size: int) -> Projection:
    return Projection((source, source), (size, size))


def premultiply(image: Image) -> Float:
    """(H, W, 4) uint8 RGBA, straight -> float32 in [0, 1], colour times alpha."""
    premultiplied: Float = np.asarray(image / np.float32(255), np.float32)
    premultiplied[..., :3] *= premultiplied[..., 3:]
    return premultiplied


def straight(premultiplied: Float) -> Image:
    """The way back, to 8 bits; no alpha-0 texel is left without a colour (unless all are)."""
    alpha = np.rint(premultiplied[..., 3] * 255).clip(0, 255).astype(np.uint8)
    colour = fill_colour(premultiplied, alpha > 0)
    return np.concatenate([np.rint(colour * 255).clip(0, 255).astype(np.uint8), alpha[..., None]], -1)


def fill_colour(premultiplied: Float, shown: NDArray[np.bool_]) -> Float:
    """Straight colours; where `shown` is false, those of the surroundings, by pull and push over a pyramid.

    Args:
        premultiplied: (S, S, 4) float32 in [0, 1].
        shown: (S, S); alpha is above 0 there.

    Returns:
        (S, S, 3) float32; 0 if nothing is shown.
    """
    level = premultiplied * shown[..., None]
    levels = [level]
    while len(levels[-1]) > 1 and not (levels[-1][..., 3] > 0).all():
        half = (len(levels[-1]) + 1) // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA), np.float32))
    colour = np.zeros((*levels[-1].shape[:2], 3), np.float32)
    for level in reversed(levels):
        size = len(level)
        coarse = cv2.resize(colour, (size, size), interpolation=cv2.INTER_LINEAR)
        alpha = level[..., 3:]
        colour = np.where(alpha > 0, level[..., :3] / np.where(alpha > 0, alpha, 1), coarse)
    return np.asarray(colour, np.float32)


def resample_store(source: Path, target: Path, size: int) -> FrameStore:
    """Resample a layered frame store (camera := layer) to `size` x `size`; returns the source.

    Raises:
        UserError: if the source is missing, damaged, or not a complete set of square RGBA images.
    """
    store = FrameStore(source)
    frames, layers = check_textures(store), store.keys()[-1][0] + 1
    each = progress(range(frames), desc="textures", unit="frame")

    def row(layer: int, k: int, image: Image) -> tuple[int, int, Image]:
        return layer, k, resample(image, size)

    rows = in_order(partial(row, layer, k, store.image(layer, k)) for k in each for layer in range(layers))
    write_frames(target, (size, size, 4), rows, packed=True)
    return store
