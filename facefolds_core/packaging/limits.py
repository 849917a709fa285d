"""From where an asset's picture is good: the manifest's `view.good`, measured on pictures of the asset itself.

Where cameras saw too little, hems fray and chins have holes: light comes through what is closed. So each direction is
judged by the patch of its picture that is worst in this, against what the middle of the filmed range has. Photos cannot
tell: there is one from where each camera stood only, and there the asset was made to agree with it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter

from facefolds_core.asset.filmed import FREE
from facefolds_core.asset.manifest_extras import Directions, FilmedView
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.rendering.camera_paths import Eye, camera_of
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import layers_in, opacity, seen_from
from facefolds_core.spacing import spread
from facefolds_core.system.threads import in_order

SIDE = 200
"""Pixels of the pictures, a side; one ray each."""
STEP = 6.0
"""Degrees between directions, about."""
FIELD_OF_VIEW = 30.0
AWAY = 3.9
"""Distance, in radii of the ball around the layers, from which it fills the picture."""
POSES = 3
"""Frames that a head that moves is looked at in; one that stands still has one."""
WORSE = 1.4
"""Times the middle's worst patch that is still good. The actor: holes and shards have 1.5 and more, what looks whole
has up to 1.3."""
CLEAN = 0.05
"""A worst patch that is good whatever the middle has."""
PATCH_SHARE, LEAST_PATCH, COVERED = 1 / 8, 8, 0.3
"""A patch's side in those of a square as large as the subject; pixels at least; its mean opacity at least."""

Array = NDArray[np.float64]


def veil_from(level: AssetLevel) -> Callable[[float, float], float]:
    """A function of azimuth and elevation, degrees: `worst_veil` from there, of the frame that is worst."""
    corners = np.concatenate([layer.vertices for layer in level.layers]).astype(np.float64)
    low, high = corners.min(0), corners.max(0)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    poses = {k: level.frame(k) for k in spread(range(level.num_frames), POSES if level.track else 1)}

    def worst(azimuth: float, elevation: float) -> float:
        eye = Eye(azimuth, elevation, AWAY * radius, tuple(centre.tolist()))
        camera = camera_of(eye, SIDE, SIDE, FIELD_OF_VIEW)
        return max(
            worst_veil(opacity(cast_layers(seen_from(level, camera, k), layers_in(level, k)), textures))
            for k, textures in poses.items()
        )

    return worst


def worst_veil(alpha: NDArray[np.floating]) -> float:
    """How much of a picture is neither opaque nor clear, in the patch where that is most: mean 4 alpha (1 - alpha).

    Args:
        alpha: (H, W) in [0, 1].

    Returns:
        in [0, 1]; 0 where no patch shows the subject.
    """
    exact = alpha.astype(np.float64)
    side = min(max(LEAST_PATCH, round(PATCH_SHARE * float(np.sqrt(exact.sum())))), *exact.shape)
    cover, veil = (uniform_filter(one, side, mode="constant") for one in (exact, 4 * exact * (1 - exact)))
    return float(np.where(cover >= COVERED, veil, 0).max())


def good_view(level: AssetLevel, filmed: FilmedView) -> Directions | None:
    """The largest range of directions around the front from all of which the picture is good.

    Args:
        filmed: which it goes beyond by FREE degrees at most.

    Returns:
        None where not even the front is better than the rest.
    """
    azimuths, elevations = (directions(*limits) for limits in (filmed.azimuth, filmed.elevation))
    worst = veil_from(level)
    veils = list(in_order(partial(worst, a, e) for e in elevations for a in azimuths))
    found = np.reshape(veils, (len(elevations), len(azimuths)))
    smooth = median_filter(found, 3, mode="nearest")  # one direction decides nothing
    typical = float(np.median(smooth[np.ix_(middle_half(elevations), middle_half(azimuths))]))
    start = nearest_to_front(elevations), nearest_to_front(azimuths)
    chosen = largest_range(smooth <= max(CLEAN, WORSE * typical), start)
    if chosen is None:
        return None
    (bottom, top), (right, left) = chosen
    return Directions(
        azimuth=(round(float(azimuths[right]), 2), round(float(azimuths[left]), 2)),
        elevation=(round(float(elevations[bottom]), 2), round(float(elevations[top]), 2)),
    )


def directions(low: float, high: float) -> Array:
    """From end to end of a range in degrees, FREE beyond it, STEP apart at most."""
    low, high = low - FREE, high + FREE
    return np.linspace(low, high, int(np.ceil((high - low) / STEP)) + 1)


def middle_half(angles: Array) -> NDArray[np.intp]:
    """Their numbers, of the range's middle half; one at least."""
    away = np.abs(angles - (angles[0] + angles[-1]) / 2)
    return np.flatnonzero(away <= max((angles[-1] - angles[0]) / 4, away.min()))


def nearest_to_front(angles: Array) -> int:
    """Number of the angle nearest to 0 where that was filmed, else to the middle."""
    front = 0.0 if angles[0] <= 0 <= angles[-1] else (angles[0] + angles[-1]) / 2
    return int(np.abs(angles - front).argmin())


def largest_range(good: NDArray[np.bool_], start: tuple[int, int]) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """The largest rectangle of good cells that holds a cell: first and last row, first and last column. Columns count
    twice, since one turns sideways more than up and down.

    Args:
        good: (E, A).
        start: row and column of the cell.

    Returns:
        None where the cell itself is not good.
    """
    row, column = start
    best, most = None, 0
    for above, below in combinations_with_replacement(range(len(good)), 2):
        if not above <= row <= below:
            continue
        bad = np.flatnonzero(~good[above : below + 1].all(0))
        if column in bad:
            continue
        first = int(bad[bad < column].max(initial=-1)) + 1
        last = int(bad[bad > column].min(initial=good.shape[1])) - 1
        size = (below - above + 1) * (last - first + 1) ** 2
        if size > most:
            best, most = ((above, below), (first, last)), size
    return best
