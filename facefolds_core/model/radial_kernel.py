"""First crossings of rays with radius maps, compiled.

Reference: `radial.reference_crossings` (torch)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.geometry.chart_kernel import chart_position
from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.kernels.jit import compiled, inlined, kernel

Array = NDArray[Any]

_TO_UV = 2.0 / math.pi


@inlined
def _grid_position(u, v, window, rows, columns):  # type: ignore[no-untyped-def]
    """Row and column (continuous, node 0 at the window's top left corner) of (u, v)."""
    row = (window[1] - u) / (window[1] - window[0]) * (rows - 1)
    column = (v - window[2]) / (window[3] - window[2]) * (columns - 1)
    return row, column


@inlined
def _look_up(rho, row, column, layer):  # type: ignore[no-untyped-def]
    """Bilinear radius of one layer; the position lies inside the grid."""
    i = min(int(row), rho.shape[0] - 2)
    j = min(int(column), rho.shape[1] - 2)
    a = row - i
    b = column - j
    top = rho[i, j, layer] * (1 - b) + rho[i, j + 1, layer] * b
    bottom = rho[i + 1, j, layer] * (1 - b) + rho[i + 1, j + 1, layer] * b
    return top * (1 - a) + bottom * a


SKIP = 0.03
"""Length of a stride through empty space, units."""

CEILING_CELLS = 128
"""A side of `ceiling`, over u and v in [-2, 2]."""


def ceiling(rho: Array, window: Array, belt: Array) -> Array:
    """(CEILING_CELLS, CEILING_CELLS) float32: a bound on the radii that a stride of SKIP from there can come near.

    Cell (i, j) covers u from the top and v from the left. Its value is the largest outermost radius at any grid node
    within the cell or within the angle under which SKIP is seen from the rays' origin at the smallest radius; 0 where
    the window is farther away than that.
    """
    rows, columns = rho.shape[:2]
    stride = SKIP * belt[2]
    sliding = stride * belt[3] if math.isfinite(belt[1]) else 0.0
    reach = max(math.asin(stride / max(float(rho[..., 0].min()) - stride, stride)), sliding)
    reach = _TO_UV * reach + 4.0 / CEILING_CELLS
    top = np.zeros((CEILING_CELLS, CEILING_CELLS), np.float32)
    u = np.linspace(window[1], window[0], rows)
    v = np.linspace(window[2], window[3], columns)
    # Meridians converge: the same angle spans more of v towards the poles.
    shrink = math.cos(math.pi / 2 * min(0.95, max(abs(window[0]), abs(window[1])) + reach))
    edges = np.linspace(-2, 2, CEILING_CELLS + 1)
    for i in range(CEILING_CELLS):
        high, low = -edges[i], -edges[i + 1]
        r = np.flatnonzero((u >= low - reach) & (u <= high + reach))
        if len(r) == 0:
            continue
        band = rho[r[0] : r[-1] + 1, :, 0].max(0)
        for j in range(CEILING_CELLS):
            c = np.flatnonzero((v >= edges[j] - reach / shrink) & (v <= edges[j + 1] + reach / shrink))
            if len(c):
                top[i, j] = band[c[0] : c[-1] + 1].max()
    return top


@kernel(parallel=True)
def crossing_distances(
    offsets: Array,  # (R, 3) ray origins minus c, float64
    directions: Array,  # (R, 3) unit, float64
    rho: Array,  # (rows, columns, N) radii, outermost first, NaN where a layer has none, float32
    window: Array,  # (4,) u0, u1, v0, v1
    belt: Array,  # (4,) of `Chart.numbers`
    ceiling: Array,  # of `ceiling`
    bound: float,
    step: float,
) -> Array:
    """(R, N) float32: distance of the nearest crossing with each layer; 0 where there is none.

    Marches with `step` between samples through the ball |x - c| < `bound` (its front half, where the window has no
    more), and in strides of SKIP far above all layers. A crossing lies between neighbouring samples inside the window
    at which the radius minus rho changes sign; it is refined by regula falsi.
    """
    result = np.zeros((offsets.shape[0], rho.shape[2]), np.float32)
    for ray in prange(offsets.shape[0]):
        one, other = np.empty(rho.shape[2], np.float64), np.empty(rho.shape[2], np.float64)
        cross(ray, offsets, directions, rho, window, belt, ceiling, bound, step, result, one, other)
    return result


@compiled
def cross(
    ray: Any,
    offsets: Any,
    directions: Any,
    rho: Any,
    window: Any,
    belt: Any,
    ceiling: Any,
    bound: Any,
    step: Any,
    result: Any,
    previous: Any,
    current: Any,
) -> None:
    """`crossing_distances` of one ray, into result, which is 0. Scratch: two arrays (N,) float64."""
    rows, columns, layers = rho.shape
    cells = ceiling.shape[0]
    ox, oy, oz = offsets[ray, 0], offsets[ray, 1], offsets[ray, 2]
    dx, dy, dz = directions[ray, 0], directions[ray, 1], directions[ray, 2]
    along = ox * dx + oy * dy + oz * dz
    disc = along * along - (ox * ox + oy * oy + oz * oz - bound * bound)
    if disc <= 0.0:
        return
    half = math.sqrt(disc)
    near, far = max(-along - half, 0.0), -along + half
    if window[2] >= -1.0 and window[3] <= 1.0:  # nothing behind c
        if dx > 0.0:
            near = max(near, -ox / dx)
        elif dx < 0.0:
            far = min(far, -ox / dx)
    if far <= near:
        return
    found = 0
    last = -1.0  # distance of the last sample inside the window; < 0: none
    state = 0  # of that sample: 1 above all layers, 2 below all, 3 among them
    row_before = 0.0
    column_before = 0.0
    s = near
    while True:
        x, y, z = ox + s * dx, oy + s * dy, oz + s * dz
        u, v, r = chart_position(x, y, z, belt)
        ci = min(max(int((2.0 - u) * 0.25 * cells), 0), cells - 1)
        cj = min(max(int((v + 2.0) * 0.25 * cells), 0), cells - 1)
        if r - SKIP * belt[2] > ceiling[ci, cj]:
            last = -1.0
            if s >= far:
                break
            s = min(s + SKIP, far)
            continue
        row, column = _grid_position(u, v, window, rows, columns)
        if row < 0.0 or column < 0.0 or row > rows - 1 or column > columns - 1:
            last = -1.0
        else:
            i = min(int(row), rows - 2)
            j = min(int(column), columns - 2)
            a, b = row - i, column - j
            w00, w01, w10, w11 = (1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b
            for n in range(layers):
                current[n] = r - (
                    w00 * rho[i, j, n] + w01 * rho[i, j + 1, n] + w10 * rho[i + 1, j, n] + w11 * rho[i + 1, j + 1, n]
                )
            now = 1 if current[0] >= 0.0 else (2 if current[layers - 1] < 0.0 else 3)
            if last >= 0.0 and (now != state or now == 3):
                # Grid position along the bracket: a parabola through its ends and its middle.
                t = 0.5 * (last + s)
                mx, my, mz = ox + t * dx, oy + t * dy, oz + t * dz
                mid_u, mid_v, _ = chart_position(mx, my, mz, belt)
                mid_row, mid_column = _grid_position(mid_u, mid_v, window, rows, columns)
                bend_row = 2.0 * (row_before + row) - 4.0 * mid_row
                bend_column = 2.0 * (column_before + column) - 4.0 * mid_column
                for n in range(layers):
                    if math.isnan(previous[n] + current[n]):  # no surface there
                        continue
                    if result[ray, n] == 0.0 and (previous[n] >= 0.0) != (current[n] >= 0.0):
                        fa, fb, ga, gb = 0.0, 1.0, previous[n], current[n]
                        f = 0.0
                        for _ in range(8):
                            f = fa + (fb - fa) * (ga / (ga - gb))
                            d = last + f * (s - last)
                            x, y, z = ox + d * dx, oy + d * dy, oz + d * dz
                            at_row = row_before + f * (row - row_before + bend_row * (f - 1.0))
                            at_column = column_before + f * (column - column_before + bend_column * (f - 1.0))
                            _, _, at_radius = chart_position(x, y, z, belt)
                            gm = at_radius - _look_up(rho, at_row, at_column, n)
                            if abs(gm) < 1e-6 or math.isnan(gm):
                                break
                            if (gm >= 0.0) == (ga >= 0.0):
                                fa, ga = f, gm
                                gb *= 0.5  # Illinois: the stale end counts half
                            else:
                                fb, gb = f, gm
                                ga *= 0.5
                        result[ray, n] = last + f * (s - last)
                        found += 1
                if found == layers:
                    break
            state = now
            last = s
            row_before, column_before = row, column
            previous, current = current, previous
        if s >= far:
            break
        s = min(s + step, far)


@kernel(parallel=True)
def texture_positions(
    offsets: Array,  # (R, 3) float64
    directions: Array,  # (R, 3) float64
    distance: Array,  # (R, N) float32, 0 where missed
    window: Array,  # (4,)
    belt: Array,  # (4,)
) -> Array:
    """(R, N, 2) uint16: s and t of the crossings over the window, as `hit_codes` has them."""
    codes = np.zeros((distance.shape[0], distance.shape[1], 2), np.uint16)
    for ray in prange(distance.shape[0]):
        encode(ray, offsets, directions, distance, window, belt, codes)
    return codes


@compiled
def encode(ray: Any, offsets: Any, directions: Any, distance: Any, window: Any, belt: Any, codes: Any) -> None:
    """`texture_positions` of one ray, into codes, which are 0."""
    for n in range(distance.shape[1]):
        d = distance[ray, n]
        if d == 0.0:
            continue
        x = offsets[ray, 0] + d * directions[ray, 0]
        y = offsets[ray, 1] + d * directions[ray, 1]
        z = offsets[ray, 2] + d * directions[ray, 2]
        u, v, _ = chart_position(x, y, z, belt)
        row, column = _grid_position(u, v, window, 2, 2)
        codes[ray, n, 0] = int(1.5 + SCALE * min(max(column, 0.0), 1.0))
        codes[ray, n, 1] = int(1.5 + SCALE * min(max(row, 0.0), 1.0))
