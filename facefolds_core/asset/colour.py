"""RGB <-> Y'CbCr 4:2:0, BT.709, limited range, chroma sited left: the one conversion of the asset's video.

Own code rather than swscale's: PyAV has no way to name the siting, and swscale (measured) does not place chroma there:
on a fine texture, before the codec, its frames read by a decoder that follows the standard give 42 dB, ours 50.

Matrix (ITU-R BT.709-6, items 3.2 and 3.3), with R, G, B, Y' in [0, 1] and Cb, Cr in [-0.5, 0.5]:
Y' = 0.2126 R + 0.7152 G + 0.0722 B, Cb = (B - Y') / 1.8556, Cr = (R - Y') / 1.5748; codes 16 + 219 Y', 128 + 224 C.
Chroma sample (i, j) lies, in luma's pixel indices, at row 2i + 0.5 and column 2j.
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
    """RGB (H, W, 3), H and W even -> Y (H, W), Cb and Cr (H/2, W/2). Borders are repeated outwards.

    Chroma is filtered by (1 2 1)/4 across, about the column it is sited at, and by the mean of two rows down.
    """
    r, g, b = (rgb[..., channel].astype(np.float32) / np.float32(255) for channel in range(3))
    luma = KR * r + KG * g + KB * b
    y = np.rint(16 + 219 * luma).astype(np.uint8)
    return y, _halve((b - luma) / CB_SCALE), _halve((r - luma) / CR_SCALE)


def yuv420_to_rgb(y: Plane, cb: Plane, cr: Plane) -> NDArray[np.uint8]:
    """Y (H, W), Cb and Cr (H/2, W/2) -> RGB (H, W, 3). Chroma is interpolated linearly from where it is sited."""
    luma = _unit_luma(y)
    r = luma + CR_SCALE * _double(cr)
    b = luma + CB_SCALE * _double(cb)
    g = (luma - KR * r - KB * b) / KG
    return np.stack([_to_byte(value) for value in (r, g, b)], -1)


def alpha_to_luma(alpha: NDArray[np.uint8]) -> Plane:
    """Alpha 0..255 -> luma code 16..235. 256 values into 220: what comes back is at most 1 off."""
    luma: Plane = np.rint(16 + alpha.astype(np.float32) * (219 / 255)).astype(np.uint8)
    return luma


def luma_to_alpha(y: Plane) -> NDArray[np.uint8]:
    """Luma codes -> alpha 0..255; codes outside 16..235 (the codec's overshoot) become 0 and 255."""
    return _to_byte(_unit_luma(y))


def _unit_luma(y: Plane) -> Float:
    unit: Float = (y.astype(np.float32) - np.float32(16)) / np.float32(219)
    return unit


def _to_byte(value: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    codes: Plane = np.rint(np.clip(value, 0, 1) * 255).astype(np.uint8)
    return codes


def _halve(chroma: Float) -> Plane:
    """(H, W) in [-0.5, 0.5] -> codes (H/2, W/2)."""
    rows = chroma[0::2] + chroma[1::2]
    left = np.concatenate([rows[:, :1], rows[:, 1:-1:2]], 1)
    mean = (left + 2 * rows[:, 0::2] + rows[:, 1::2]) / 8
    codes: Plane = np.rint(NEUTRAL + 224 * mean).astype(np.uint8)
    return codes


def _double(codes: Plane) -> Float:
    """Codes (h, w) -> chroma in [-0.5, 0.5] at luma's pixels (2h, 2w)."""
    chroma = (codes.astype(np.float32) - NEUTRAL) / 224
    above = np.concatenate([chroma[:1], chroma[:-1]])
    below = np.concatenate([chroma[1:], chroma[-1:]])
    rows = np.empty((2 * chroma.shape[0], chroma.shape[1]), np.float32)
    rows[0::2] = 0.75 * chroma + 0.25 * above
    rows[1::2] = 0.75 * chroma + 0.25 * below
    full = np.empty((rows.shape[0], 2 * rows.shape[1]), np.float32)
    full[:, 0::2] = rows
    full[:, 1::2] = 0.5 * (rows + np.concatenate([rows[:, 1:], rows[:, -1:]], 1))
    return full
