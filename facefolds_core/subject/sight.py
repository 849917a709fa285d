"""Which points the cameras see, compiled for CPUs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.kernels.jit import kernel


def seen_by(cameras: Sequence[Camera], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(P,) in how many of the cameras' images points (P, 3) lie."""
    poses = np.stack([camera.w2c for camera in cameras]).astype(np.float64)
    lenses = np.stack([camera.K for camera in cameras]).astype(np.float64)
    sizes = np.array([(camera.width, camera.height) for camera in cameras], np.float64)
    count: NDArray[np.int64] = _count(np.ascontiguousarray(points, np.float64), poses, lenses, sizes)
    return count


@kernel(parallel=True)
def _count(points, poses, lenses, sizes):  # type: ignore[no-untyped-def]
    """(P, 3) points, (C, 3, 4) w2c, (C, 3, 3) K, (C, 2) widths and heights -> (P,) how many see each."""
    found = np.zeros(points.shape[0], np.int64)
    for p in prange(points.shape[0]):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        for c in range(poses.shape[0]):
            w, k = poses[c], lenses[c]
            right = w[0, 0] * x + w[0, 1] * y + w[0, 2] * z + w[0, 3]
            down = w[1, 0] * x + w[1, 1] * y + w[1, 2] * z + w[1, 3]
            ahead = w[2, 0] * x + w[2, 1] * y + w[2, 2] * z + w[2, 3]
            column = k[0, 0] * right + k[0, 1] * down + k[0, 2] * ahead
            row = k[1, 0] * right + k[1, 1] * down + k[1, 2] * ahead
            # Without a division: 0 <= column / ahead < width.
            if ahead > 0 and 0 <= column < sizes[c, 0] * ahead and 0 <= row < sizes[c, 1] * ahead:
                found[p] += 1
    return found
