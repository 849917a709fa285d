"""RGB <-> Y'CbCr 4:2:0, BT.709, limited range, chroma sited in the centre: the one conversion of the asset's video.

Own code rather than swscale's: PyAV has no way to name the siting, and swscale (measured) places chroma elsewhere.

In the centre, because that is where browsers and graphics cards look, whatever the stream says: a linear look-up in a
plane of half the size at luma's coordinate is right for centred chroma. Sited left, as H.264 does by default, every
player that does so shows chroma half a pixel to the side: measured, Chromium against the reference renderer on the
conformance vectors, 42 dB over the head, and 51 with chroma in the centre.

Matrix (ITU-R BT.709-6, items 3.2 and 3.3), with R, G, B, Y' in [0, 1] and Cb, Cr in [-0.5, 0.5]:
Y' = 0.2126 R + 0.7152 G + 0.0722 B, Cb = (B - Y') / 1.8556, Cr = (R - Y') / 1.5748; codes 16 + 219 Y', 128 + 224 C.
Chroma sample (i, j) lies, in luma's pixel indices, at row 2i + 0.5 and column 2j + 0.5.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.uint8]
Float = NDArray[np.float32]

KR, KG, KB = 0.2126, 0.7152, 0.0722
CB_SCALE, CR_SCALE = 2 * (1 - KB), 2 * (1 - KR)
NEUTRAL = 128
BLACK = 16


def rgb_to_yuv420(rgb: NDArray[np.uint8]) -> tuple[Plane, Plane, Plane]:
    """RGB (H, W, 3), H and W even -> Y (H, W), Cb and Cr (H/2, W/2).

    Chroma is what comes nearest when it is interpolated: least squares. Means of 2 x 2 pixels would be blurred twice,
    by the mean and by the interpolation: with them half of the detail that `actor`'s video lost was lost here
    (docs/research/codec.md).
    """
    r, g, b = (rgb[..., channel].astype(np.float32) / np.float32(255) for channel in range(3))
    luma = KR * r + KG * g + KB * b
    y = np.rint(16 + 219 * luma).astype(np.uint8)
    return y, _halve((b - luma) / CB_SCALE), _halve((r - luma) / CR_SCALE)


def yuv420_to_rgb(y: Plane, cb: Plane, cr: Plane) -> NDArray[np.uint8]:
    """Y (H, W), Cb and Cr (H/2, W/2) -> RGB (H, W, 3). Chroma is interpolated linearly."""
    luma = _unit_luma(y)
    r = luma + CR_SCALE * _double(cr)
    b = luma + CB_SCALE * _double(cb)
    g = (luma - KR * r - KB * b) / KG
    return np.stack([_to_byte(value) for value in (r, g, b)], -1)


def alpha_to_luma(alpha: NDArray[np.uint8]) -> Plane:
    """Alpha 0..255 -> luma code 16..235. 256 values into 220: what comes back is at most 1 off."""
    return np.asarray(np.rint(16 + alpha.astype(np.float32) * (219 / 255)), np.uint8)


def luma_to_alpha(y: Plane) -> NDArray[np.uint8]:
    """Luma codes -> alpha 0..255; codes outside 16..235 (the codec's overshoot) become 0 and 255."""
    return _to_byte(_unit_luma(y))


def _unit_luma(y: Plane) -> Float:
    return (y.astype(np.float32) - np.float32(16)) / np.float32(219)


def _to_byte(value: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    return np.asarray(np.rint(np.clip(value, 0, 1) * 255), np.uint8)


def _halve(chroma: Float) -> Plane:
    """(H, W) in [-0.5, 0.5] -> codes (H/2, W/2), within those that colours have."""
    fitted = _fitted(np.ascontiguousarray(_fitted(chroma).T)).T
    return np.asarray(np.rint(NEUTRAL + 224 * fitted.clip(-0.5, 0.5)), np.uint8)


def _fitted(values: Float) -> Float:
    """Rows (2h, w) -> (h, w): those whose `_between` is nearest.

    The normal equations are tridiagonal, 1.25 on the diagonal (0.375 more at each end) and 0.375 beside it: eliminated
    downwards and put in upwards, row by row. LAPACK's solver takes 35 times as long for many columns.
    """
    even, odd = values[0::2], values[1::2]
    found = np.float32(0.75) * (even + odd)
    found += np.float32(0.25) * (np.concatenate([even[:1], odd[:-1]]) + np.concatenate([even[1:], odd[-1:]]))
    h, beside = len(found), 0.375
    diagonal = [1.25 + beside * ((i == 0) + (i == h - 1)) for i in range(h)]
    for i in range(1, h):
        share = beside / diagonal[i - 1]
        diagonal[i] -= share * beside
        found[i] -= np.float32(share) * found[i - 1]
    found[-1] /= np.float32(diagonal[-1])
    for i in range(h - 2, -1, -1):
        found[i] = (found[i] - np.float32(beside) * found[i + 1]) / np.float32(diagonal[i])
    return found


def _double(codes: Plane) -> Float:
    """Codes (h, w) -> chroma in [-0.5, 0.5] at luma's pixels (2h, 2w)."""
    chroma: Float = (codes.astype(np.float32) - np.float32(NEUTRAL)) / np.float32(224)
    return np.ascontiguousarray(_between(_between(chroma).T).T)


def _between(values: Float) -> Float:
    """Rows (h, w) -> (2h, w): those that lie a quarter of the distance before and after each."""
    before = np.concatenate([values[:1], values[:-1]])
    after = np.concatenate([values[1:], values[-1:]])
    full = np.empty((2 * values.shape[0], values.shape[1]), np.float32)
    full[0::2] = 0.75 * values + 0.25 * before
    full[1::2] = 0.75 * values + 0.25 * after
    return full
