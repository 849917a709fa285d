"""From the texels of one grid to those of another: least squares instead of look-ups.

A picture that is bilinear between texels of its own loses its finest detail when it is looked up at the texels of
another grid and interpolated again: each look-up between texels is a mean of them, and so is each interpolation. Here
the new texels are those whose bilinear interpolation is nearest to the picture, over all places and not at the texels
alone (an L2 projection; Unser, Aldroubi and Eden 1995). Rows and columns are independent of each other.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Float = NDArray[np.float32]

BLOCK = 64
"""Neighbouring texels that are worked out together: only the texels around them have a weight in them."""
FAINT = 1e-8
"""Weights below are left out: they fall to a quarter from each texel to the next, so all of them together are less than
float32 rounds (seen: 4e-7 of values in [0, 1])."""


def interpolation(positions: Array, size: int) -> Array:
    """(P, size): the weights with which `size` texels along [0, 1] are interpolated at positions (P,), clamped."""
    at = np.clip(positions * size - 0.5, 0, size - 1)
    before = np.minimum(at.astype(np.intp), max(size - 2, 0))
    fraction = at - before
    matrix = np.zeros((len(positions), size))
    rows = np.arange(len(positions))
    matrix[rows, before] += 1 - fraction
    matrix[rows, np.minimum(before + 1, size - 1)] += fraction
    return matrix


class Projection:
    """An image on the texels of another grid, within the values of the texels around each place: no edge overshoots.

    Args:
        source: (H, W) texels of the image, over [0, 1] along each side.
        target: (R, S) texels.
        box: top, bottom, left, right of their image, in the other's [0, 1]; beyond that its border goes on.
    """

    def __init__(
        self,
        source: tuple[int, int],
        target: tuple[int, int],
        box: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0),
    ) -> None:
        rows, self._near_rows = _along(source[0], target[0], box[0], box[1])
        columns, self._near_columns = _along(source[1], target[1], box[2], box[3])
        self._rows, self._columns = Bands(rows), Bands(columns)

    def __call__(self, image: Float) -> Float:
        """(H, W, C) -> (R, S, C)."""
        h, w, c = image.shape
        half = (self._rows @ image.reshape(h, w * c)).reshape(-1, w, c)
        whole = self._columns @ half.swapaxes(0, 1).reshape(w, -1)
        around = np.ones((3, 3), np.uint8)
        least, most = (
            extreme(image, around).reshape(h, w, c)[self._near_rows[:, None], self._near_columns]
            for extreme in (cv2.erode, cv2.dilate)
        )
        return np.asarray(np.clip(whole.reshape(-1, len(half), c).swapaxes(0, 1), least, most), np.float32)


class Bands:
    """A matrix `weights` (R, H), nearly 0 but around its diagonal, in blocks of neighbouring rows: `bands @ values`."""

    def __init__(self, weights: Float) -> None:
        self._blocks, self._shape = [], weights.shape
        for first in range(0, len(weights), BLOCK):
            part = weights[first : first + BLOCK]
            used = np.flatnonzero((np.abs(part) >= FAINT).any(0))
            low, high = (int(used[0]), int(used[-1]) + 1) if len(used) else (0, 0)
            self._blocks.append((first, low, high, np.ascontiguousarray(part[:, low:high])))

    def __matmul__(self, values: Float) -> Float:
        """(H, M) -> (R, M)."""
        found = np.empty((self._shape[0], values.shape[1]), np.float32)
        for first, low, high, part in self._blocks:
            np.matmul(part, values[low:high], out=found[first : first + len(part)])
        return found


def _along(source: int, target: int, start: float, end: float) -> tuple[Float, NDArray[np.intp]]:
    """(target, source) weights of the texels of a side for those along [start, end] of it, and the nearest (target,)
    of them."""
    knots = [(np.arange(target) + 0.5) / target, ((np.arange(source) + 0.5) / source - start) / (end - start)]
    ends = np.unique(np.concatenate([*knots, [0.0, 1.0]]).clip(0, 1))
    # Both are linear between knots: two Gauss points an interval integrate their products exactly.
    half = 0.5 * np.diff(ends)
    middle = ends[:-1] + half
    places = np.concatenate([middle - half / math.sqrt(3), middle + half / math.sqrt(3)])
    shown, wanted = interpolation(places, target), interpolation(start + (end - start) * places, source)
    weighed = (shown * np.tile(half, 2)[:, None]).T
    weights = np.linalg.solve(weighed @ shown, weighed @ wanted)
    centres = start + (end - start) * (np.arange(target) + 0.5) / target
    return weights.astype(np.float32), (centres * source).astype(np.intp).clip(0, source - 1)
