"""Texels where the surface is: a warp of the chart after which all of them cover about the same area.

By angle alone a texel at a head's side covers a fifth of what it does in the face, and on a wall, as between chin and
neck, it covers centimetres.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import ALL_AROUND, Window, window_uv
from facefolds_core.geometry.warp import evened

Array = NDArray[np.float64]

DENSITIES = 0.5, 2.0
"""The least and the greatest area of a cell, in those of the median one, that count: what is seen from aside alone, as
most walls are, need not have all that it covers."""
SURFACE_BLUR = 1.0
"""Standard deviation by which the surface is smoothed, nodes: noise has an area, too."""
BLUR = 2.0
"""The same of the areas: texels are as good as square then."""


def with_even_texels(chart: Chart, window: Window, radii: Array, there: NDArray[np.bool_]) -> Chart:
    """The chart, warped within a window.

    Args:
        chart: without a warp.
        radii: (rows, columns) of the surface at the nodes over the window.
        there: (rows, columns) where the subject is.
    """
    points = chart.points(window_uv(window, *radii.shape), ndimage.gaussian_filter(radii, SURFACE_BLUR))
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    area, (least, most) = np.linalg.norm(normals, axis=-1), DENSITIES
    share = np.where(there, (area / np.median(area[there])).clip(least, most), least)
    density = ndimage.gaussian_filter(share, BLUR, mode="nearest")
    if window[3] - window[2] >= ALL_AROUND:
        density[:, [0, -1]] = density[:, [0, -1]].mean(1, keepdims=True)
    return replace(chart, warp=evened(density, window))
