"""Area averages of whole pictures, compiled: what `images.downsample` computes, in a third of the time.

Rows are summed first, all columns at once (which vector units do), then columns of the few rows that remain. Sums run
in another order than OpenCV's: results differ by rounding, so that photos keep OpenCV's.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.kernels.jit import kernel


@kernel(nogil=True)
def _area_mean(
    data: NDArray[np.uint8], pitch: int, rows: int, columns: int, channels: int, height: int, width: int, whole: bool
) -> Any:
    """Rows of columns * channels bytes -> (height, width * channels) float32: mean of what each target covers.

    Args:
        data: bytes, a row each `pitch`.
        whole: round to whole numbers, halves to even.
    """
    size = columns * channels
    tall, wide = rows / height, columns / width
    most = math.ceil(wide) + 1
    shares = np.zeros((width, most), np.float32)
    first = np.zeros(width, np.int64)
    count = np.zeros(width, np.int64)
    for j in range(width):
        left, right = j * wide, (j + 1) * wide
        first[j] = int(left)
        count[j] = min(columns, math.ceil(right - 1e-9)) - first[j]
        for k in range(count[j]):
            shares[j, k] = (min(right, first[j] + k + 1.0) - max(left, first[j] + k)) / wide
    summed = np.empty(size, np.float32)
    out = np.empty((height, width * channels), np.float32)
    for i in range(height):
        low, high = i * tall, (i + 1) * tall
        summed[:] = np.float32(0)
        for row in range(int(low), min(rows, math.ceil(high - 1e-9))):
            weight = np.float32((min(high, row + 1.0) - max(low, row)) / tall)
            line = data[row * pitch : row * pitch + size]
            for x in range(size):
                summed[x] += weight * np.float32(line[x])
        for j in range(width):
            place = first[j] * channels
            if channels == 3:  # written out: twice as fast as the loop below
                red, green, blue = np.float32(0), np.float32(0), np.float32(0)
                for k in range(count[j]):
                    red += shares[j, k] * summed[place + 3 * k]
                    green += shares[j, k] * summed[place + 3 * k + 1]
                    blue += shares[j, k] * summed[place + 3 * k + 2]
                out[i, 3 * j], out[i, 3 * j + 1], out[i, 3 * j + 2] = red, green, blue
                continue
            for c in range(channels):
                total = np.float32(0)
                for k in range(count[j]):
                    total += shares[j, k] * summed[place + k * channels + c]
                out[i, j * channels + c] = total
        if whole:
            for x in range(out.shape[1]):
                out[i, x] = np.rint(out[i, x])
    return out


def area_mean(image: NDArray[np.uint8], width: int, height: int, whole: bool = False) -> NDArray[np.float32]:
    """(H, W, C) uint8 -> (height, width, C) float32 in 0..255; not larger than the picture.

    Args:
        whole: round to whole numbers, halves to even.
    """
    rows, columns, channels = image.shape
    if image.strides[1:] != (channels, 1):
        image = np.ascontiguousarray(image)
    pitch = image.strides[0]
    data = np.lib.stride_tricks.as_strided(image, ((rows - 1) * pitch + columns * channels,), (1,), writeable=False)
    sums = _area_mean(data, pitch, rows, columns, channels, height, width, whole)
    return np.asarray(sums).reshape(height, width, channels)
