"""Whether one layer lies around another, seen from the centre of the UV map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.meshes import TexturedMesh

BINS = 24
"""Of longitude and of the sine of latitude."""
LEAST_SHARED = 8
"""Bins that both meshes must have for an answer."""
MOST_WRONG = 0.75
"""Of the shared bins: layers touch, fold and have noise, so a few crossings mean nothing."""


def lies_within(outer: TexturedMesh, inner: TexturedMesh, centre: tuple[float, float, float]) -> bool:
    """Whether `outer`, of two neighbours from the outermost in, clearly lies within `inner`: the wrong order."""
    a, b = _radii(outer, centre), _radii(inner, centre)
    shared = np.isfinite(a) & np.isfinite(b)
    if shared.sum() < LEAST_SHARED:
        return False
    return bool((a[shared] < b[shared]).mean() > MOST_WRONG)


def _radii(mesh: TexturedMesh, centre: tuple[float, float, float]) -> NDArray[np.float64]:
    """(BINS * BINS,) mean distance from the centre of the faces' middles in each bin of directions; NaN where none."""
    middles = mesh.vertices[mesh.faces].astype(np.float64).mean(1) - np.array(centre)
    radii = np.maximum(np.linalg.norm(middles, axis=1), 1e-12)
    longitude = (np.arctan2(middles[:, 1], middles[:, 0]) / np.pi + 1) / 2
    latitude = (middles[:, 2] / radii + 1) / 2
    places = [np.minimum((BINS * part).astype(np.int64), BINS - 1) for part in (longitude, latitude)]
    index = places[0] * BINS + places[1]
    counts = np.bincount(index, minlength=BINS * BINS)
    sums = np.bincount(index, weights=radii, minlength=BINS * BINS)
    with np.errstate(invalid="ignore"):
        return np.asarray(sums / counts)
