"""First crossings of rays with radius maps, compiled.

Reference: `radial.reference_crossings` (torch)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.geometry.chart_kernel import chart_position, chart_radius
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


TRIES, EXACT = 8, 1e-6
"""Regula falsi's steps for the share of a point in a torso's band, and from which error on it is exact."""


@compiled
def placed(x: Any, y: Any, z: Any, bend: Any) -> Any:
    """Where a point, relative to c, is on the layers as they were made: the inverse of `Torso.posed`."""
    if bend is None:
        return x, y, z
    low = _share(x, y, z, bend)
    if low <= 0.0:
        return x, y, z
    hx, hy, hz = _straightened(x, y, z, 1.0, bend)
    high = _share(hx, hy, hz, bend) - 1.0
    if high >= 0.0:
        return hx, hy, hz
    a, b, ga, gb = 0.0, 1.0, low, high
    side = 0
    for _ in range(TRIES):
        share = a + (b - a) * (ga / (ga - gb))
        hx, hy, hz = _straightened(x, y, z, share, bend)
        off = _share(hx, hy, hz, bend) - share
        if abs(off) < EXACT:
            break
        if off > 0.0:
            a, ga = share, off
            if side == 1:
                gb *= 0.5  # Illinois: an end that is stale twice counts half
            side = 1
        else:
            b, gb = share, off
            if side == -1:
                ga *= 0.5
            side = -1
    return hx, hy, hz


@inlined
def stride(x, y, z, step, bend):  # type: ignore[no-untyped-def]
    """Through what is empty, from a point on the layers as they were made: what is bent may be drawn together to a part
    of its length, so that no stride may lead into a torso's band."""
    if bend is None:
        return SKIP
    share, near = _share(x, y, z, bend), SKIP / bend[4]
    return SKIP if share <= -near or share >= 1.0 + near else step


@compiled
def _share(x: Any, y: Any, z: Any, bend: Any) -> Any:
    """s, from below 0 to above 1."""
    return (bend[0] * x + bend[1] * y + bend[2] * z - bend[3]) / bend[4]


@compiled
def _straightened(x: Any, y: Any, z: Any, share: Any, bend: Any) -> Any:
    """The point that a share of D brings there: ((1 - s) I + s R)^-1 (p - s t), by Cramer's rule."""
    rest = 1.0 - share
    a, b, c = rest + share * bend[5], share * bend[6], share * bend[7]
    d, e, f = share * bend[8], rest + share * bend[9], share * bend[10]
    g, h, i = share * bend[11], share * bend[12], rest + share * bend[13]
    x, y, z = x - share * bend[14], y - share * bend[15], z - share * bend[16]
    u, v, w = e * i - f * h, f * g - d * i, d * h - e * g
    scale = 1.0 / (a * u + b * v + c * w)
    return (
        scale * (u * x + (c * h - b * i) * y + (b * f - c * e) * z),
        scale * (v * x + (a * i - c * g) * y + (c * d - a * f) * z),
        scale * (w * x + (b * g - a * h) * y + (a * e - b * d) * z),
    )


SKIP = 0.02
"""Length of a stride through empty space, units: a multiple of `radial.STEP`, so that samples stay where they were."""

CELLS = 128
"""A side of `heights`, over u and v in [-2, 2]."""

HALVINGS = 6
"""Of the range in which the least radius lies from which strides are safe."""


def bounds(rho: Array) -> Array:
    """(rows - 1, columns - 1, 2) float32: the largest and the smallest radius of any layer at a cell's four nodes."""
    high, low = np.fmax.reduce(rho, axis=-1), np.fmin.reduce(rho, axis=-1)
    corners = [np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]]
    return np.stack([np.maximum.reduce([high[c] for c in corners]), np.minimum.reduce([low[c] for c in corners])], -1)


def heights(rho: Array, window: Array, belt: Array) -> Array:
    """(2, CELLS, CELLS) float32: radii from which on no stride of SKIP, in any direction, meets a layer.

    Cell (i, j) covers u from the top and v from the left. First those of all layers, then of layers that have holes.

    Args:
        rho, window, belt: as in `crossing_distances`.
    """
    found = np.zeros((2, CELLS, CELLS), np.float32)
    reach = SKIP * belt[2]
    sliding = reach * belt[3] if math.isfinite(belt[1]) else 0.0
    for own, some in zip(found, (rho, rho[..., np.isnan(rho).any((0, 1))]), strict=True):
        if some.shape[-1]:
            _heights(_coarse(bounds(some), window), reach, sliding, own)
    return found


@compiled
def _coarse(cells: Any, window: Any) -> Any:
    """The largest radius of any grid cell, of `bounds`, that touches a cell of `heights`; 0 where there is none."""
    rows, columns = cells.shape[0], cells.shape[1]
    found = np.zeros((CELLS, CELLS), np.float32)
    down, across = (window[1] - window[0]) / rows, (window[3] - window[2]) / columns
    for i in range(rows):
        top, bottom = window[1] - i * down, window[1] - (i + 1) * down
        for j in range(columns):
            left = window[2] + j * across
            for ci in range(_cell(2.0 - top), _cell(2.0 - bottom) + 1):
                for cj in range(_cell(left + 2.0), _cell(left + across + 2.0) + 1):
                    found[ci, cj] = max(found[ci, cj], cells[i, j, 0])
    return found


@inlined
def _cell(place):  # type: ignore[no-untyped-def]
    """Number of the cell of `heights` at a distance from its edge, in (u, v)."""
    return min(max(int(place * 0.25 * CELLS), 0), CELLS - 1)


@kernel(parallel=True)
def _heights(coarse: Array, reach: float, sliding: float, found: Array) -> None:
    """`heights` of some layers. A stride changes the radius by `reach` at most and, below the belt, u by `sliding`."""
    for i in prange(CELLS):
        for j in range(CELLS):
            # The farther out, the narrower the angle in which a stride ends: a radius is high enough where all within
            # the angle seen from there is lower.
            low = coarse[i, j]
            high = _highest(coarse, i, j, math.asin(reach / (low + reach)), sliding)
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if _highest(coarse, i, j, math.asin(reach / (middle + reach)), sliding) <= middle:
                    high = middle
                else:
                    low = middle
            found[i, j] = high + reach


@compiled
def _highest(coarse: Any, i: Any, j: Any, angle: Any, sliding: Any) -> Any:
    """Largest radius within an angle, radians, of cell (i, j)."""
    up = max(angle, sliding) * _TO_UV
    steps = math.ceil(up * 0.25 * CELLS)
    # Meridians converge: the same angle spans more of v towards the poles.
    height = max(abs(2.0 - i * 4.0 / CELLS), abs(2.0 - (i + 1) * 4.0 / CELLS))
    aside = angle * _TO_UV / math.cos(0.5 * math.pi * min(0.95, height + up))
    aside_steps = min(math.ceil(aside * 0.25 * CELLS), CELLS // 2)
    found = coarse[i, j]
    for ci in range(max(i - steps, 0), min(i + steps, CELLS - 1) + 1):
        for step in range(-aside_steps, aside_steps + 1):
            found = max(found, coarse[ci, (j + step) % CELLS])
    return found


@kernel(parallel=True)
def crossing_distances(
    offsets: Array,  # (R, 3) ray origins minus c, float64
    directions: Array,  # (R, 3) unit, float64
    rho: Array,  # (rows, columns, N) radii, outermost first, NaN where a layer has none, float32
    window: Array,  # (4,) u0, u1, v0, v1
    belt: Array,  # (4,) of `Chart.numbers`
    cells: Array,  # of `bounds`
    heights: Array,  # of `heights`
    whole: int,  # layers that have no holes; they come first
    bound: float,
    step: float,
    bend: Array | None,  # (18,) of `RadialManifolds.bend`, or None where all layers are as they were made
) -> Array:
    """(R, N) float32: distance of the nearest crossing with each layer; 0 where there is none.

    Marches with `step` between samples through the ball |x - c| < `bound` (its front half, where the window has no
    more), and in strides of SKIP far above all layers; of what is bent through all of a larger ball, and in a torso's
    band with `step` alone.
    A crossing lies between neighbouring samples inside the window at which the radius minus rho changes sign; it is
    refined by regula falsi.
    """
    result = np.zeros((offsets.shape[0], rho.shape[2]), np.float32)
    for ray in prange(offsets.shape[0]):
        cross(ray, offsets, directions, rho, window, belt, cells, heights, whole, bound, step, bend, result)
    return result


@compiled
def cross(
    ray: Any,
    offsets: Any,
    directions: Any,
    rho: Any,
    window: Any,
    belt: Any,
    cells: Any,
    heights: Any,
    whole: Any,
    bound: Any,
    step: Any,
    bend: Any,
    result: Any,
) -> None:
    """`crossing_distances` of one ray, into result, which is 0."""
    rows, columns, layers = rho.shape
    ox, oy, oz = offsets[ray, 0], offsets[ray, 1], offsets[ray, 2]
    dx, dy, dz = directions[ray, 0], directions[ray, 1], directions[ray, 2]
    along = ox * dx + oy * dy + oz * dz
    if bend is not None:
        bound += bend[17]
    disc = along * along - (ox * ox + oy * oy + oz * oz - bound * bound)
    if disc <= 0.0:
        return
    half = math.sqrt(disc)
    near, far = max(-along - half, 0.0), -along + half
    if bend is None:  # noqa: SIM102  numba leaves out what hangs on this alone
        if window[2] >= -1.0 and window[3] <= 1.0:
            if dx > 0.0:
                near = max(near, -ox / dx)
            elif dx < 0.0:
                far = min(far, -ox / dx)
    if far <= near:
        return
    found, found_whole = 0, 0
    last = -1.0  # distance of the last sample inside the window; < 0: none
    state = 0  # of that sample: 1 above all layers of its cell, 2 below all, 3 perhaps among them
    row_before = 0.0
    column_before = 0.0
    radius_before = 0.0
    s = near
    while True:
        x, y, z = placed(ox + s * dx, oy + s * dy, oz + s * dz, bend)
        u, v, r = chart_position(x, y, z, belt)
        ci, cj = _cell(2.0 - u), _cell(v + 2.0)
        if r > heights[int(found_whole == whole), ci, cj]:
            last = -1.0
            if s >= far:
                break
            s = min(s + stride(x, y, z, step, bend), far)
            continue
        row, column = _grid_position(u, v, window, rows, columns)
        if row < 0.0 or column < 0.0 or row > rows - 1 or column > columns - 1:
            last = -1.0
        else:
            i = min(int(row), rows - 2)
            j = min(int(column), columns - 2)
            now = 1 if r >= cells[i, j, 0] else (2 if r < cells[i, j, 1] else 3)
            if last >= 0.0 and (now != state or now == 3):
                # Grid position along the bracket: a parabola through its ends and its middle.
                t = 0.5 * (last + s)
                mx, my, mz = placed(ox + t * dx, oy + t * dy, oz + t * dz, bend)
                mid_u, mid_v, _ = chart_position(mx, my, mz, belt)
                mid_row, mid_column = _grid_position(mid_u, mid_v, window, rows, columns)
                bend_row = 2.0 * (row_before + row) - 4.0 * mid_row
                bend_column = 2.0 * (column_before + column) - 4.0 * mid_column
                for n in range(layers):
                    if result[ray, n] != 0.0:
                        continue
                    before = radius_before - _look_up(rho, row_before, column_before, n)
                    after = r - _look_up(rho, row, column, n)
                    if math.isnan(before + after):  # no surface there
                        continue
                    if (before >= 0.0) != (after >= 0.0):
                        fa, fb, ga, gb = 0.0, 1.0, before, after
                        f = 0.0
                        for _ in range(8):
                            f = fa + (fb - fa) * (ga / (ga - gb))
                            d = last + f * (s - last)
                            x, y, z = placed(ox + d * dx, oy + d * dy, oz + d * dz, bend)
                            at_row = row_before + f * (row - row_before + bend_row * (f - 1.0))
                            at_column = column_before + f * (column - column_before + bend_column * (f - 1.0))
                            at_radius = chart_radius(x, y, z, belt)
                            gm = at_radius - _look_up(rho, at_row, at_column, n)
                            if abs(gm) < 1e-6 or math.isnan(gm):
                                break
                            if (gm >= 0.0) == (ga >= 0.0):
                                fa, ga = f, gm
                                gb *= 0.5  # Illinois: the stale end counts half
                            else:
                                fb, gb = f, gm
                                ga *= 0.5
                        if bend is not None:  # noqa: SIM102  as above
                            if abs(gm) > step:  # a fold's edge, no crossing
                                continue
                        result[ray, n] = last + f * (s - last)
                        found += 1
                        found_whole += int(n < whole)
                if found == layers:
                    break
            state = now
            last = s
            row_before, column_before, radius_before = row, column, r
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
    bend: Array | None,  # of `crossing_distances`
) -> Array:
    """(R, N, 2) uint16: s and t of the crossings over the window, as `hit_codes` has them."""
    codes = np.zeros((distance.shape[0], distance.shape[1], 2), np.uint16)
    for ray in prange(distance.shape[0]):
        for n in range(distance.shape[1]):
            d = distance[ray, n]
            if d == 0.0:
                continue
            x, y, z = placed(
                offsets[ray, 0] + d * directions[ray, 0],
                offsets[ray, 1] + d * directions[ray, 1],
                offsets[ray, 2] + d * directions[ray, 2],
                bend,
            )
            u, v, _ = chart_position(x, y, z, belt)
            row, column = _grid_position(u, v, window, 2, 2)
            codes[ray, n, 0] = int(1.5 + SCALE * min(max(column, 0.0), 1.0))
            codes[ray, n, 1] = int(1.5 + SCALE * min(max(row, 0.0), 1.0))
    return codes


@kernel(parallel=True)
def placed_points(points: Array, bend: Array) -> Array:
    """(P, 3) float64: where points (P, 3), relative to c, are on the layers as they were made; see `placed`."""
    found = np.empty(points.shape)
    for k in prange(points.shape[0]):
        found[k, 0], found[k, 1], found[k, 2] = placed(points[k, 0], points[k, 1], points[k, 2], bend)
    return found
