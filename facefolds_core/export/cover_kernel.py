"""Which triangle of a mesh over a grid's vertices holds which vertex of the grid, compiled."""

from __future__ import annotations

import numpy as np

from facefolds_core.kernels.jit import inlined, kernel


@inlined
def _corners(faces, f, n, corners):  # type: ignore[no-untyped-def]
    """Writes rows and columns of a face's vertices in an n x n grid to corners (3, 2)."""
    for k in range(3):
        corners[k, 0], corners[k, 1] = faces[f, k] // n, faces[f, k] % n


@inlined
def _holds(corners, r, c):  # type: ignore[no-untyped-def]
    """Whether a triangle with corners (3, 2) in rows and columns holds the point (r, c), its border included."""
    e0 = (corners[1, 1] - corners[0, 1]) * (r - corners[0, 0]) - (corners[1, 0] - corners[0, 0]) * (c - corners[0, 1])
    e1 = (corners[2, 1] - corners[1, 1]) * (r - corners[1, 0]) - (corners[2, 0] - corners[1, 0]) * (c - corners[1, 1])
    e2 = (corners[0, 1] - corners[2, 1]) * (r - corners[2, 0]) - (corners[0, 0] - corners[2, 0]) * (c - corners[2, 1])
    return (e0 <= 0 and e1 <= 0 and e2 <= 0) or (e0 >= 0 and e1 >= 0 and e2 >= 0)


@kernel
def locate(faces, n):  # type: ignore[no-untyped-def]
    """(n, n): the last of the faces (F, 3) over an n x n grid's vertices that holds each vertex; -1 without any."""
    found = np.full((n, n), -1, np.int64)
    corners = np.empty((3, 2), np.int64)
    for f in range(faces.shape[0]):
        _corners(faces, f, n, corners)
        for r in range(corners[:, 0].min(), corners[:, 0].max() + 1):
            for c in range(corners[:, 1].min(), corners[:, 1].max() + 1):
                if _holds(corners, r, c):
                    found[r, c] = f
    return found
