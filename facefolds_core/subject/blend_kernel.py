"""Gaussians of a picture blended from front to back, tile by tile, and the gradients: compiled.

A tile is one row of lanes wide (`lanes.py`). Each pair of a Gaussian and a tile is an *entry*; a Gaussian's entries are
neighbours, so that its gradient is a sum over neighbours, whatever thread made them.

Reference: `tests/subject/reference.py`."""

# numba has no types:
# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from facefolds_core.kernels.jit import compiled, inlined, kernel
from facefolds_core.kernels.lanes import LANES, fill, highest, least, load, most, store, total, where_less
from facefolds_core.subject.project_kernel import FAINT, FLAT

TILE = (LANES, 16)
"""Pixels, width and height."""
PIXELS = TILE[0] * TILE[1]
SOLID = 0.99
"""No Gaussian is more opaque, so that what is behind it keeps a gradient."""
DARK = 1e-4
"""Where less light is left, nothing more is blended."""
FARTHEST = 5.6
"""exp(-p) is nothing beyond: opacity is at most 1, and `FAINT` is exp(-5.54)."""
OFTEN = 8
"""After so many entries of a tile it is asked whether it is full."""


@kernel
def list_entries(tiles, order, across, down, first, starts):
    """Entries of all tiles, nearest first.

    Args:
        tiles: of `project`.
        order: (V,) Gaussians that are seen, nearest first.
        across, down: number of tiles.
        first: (N + 1,) int64 out: entries first[n] to first[n + 1] are those of Gaussian n.
        starts: (across * down + 1,) int64 out: entries starts[k] to starts[k + 1] of the list are those of tile k.

    Returns:
        Per place in the list the entry and its Gaussian, (E, 2) int32.
    """
    starts[:] = 0
    first[0] = 0
    for n in range(tiles.shape[0]):
        wide, high = tiles[n, 1] - tiles[n, 0], tiles[n, 3] - tiles[n, 2]
        first[n + 1] = first[n] + wide * high
        for j in range(tiles[n, 2], tiles[n, 3]):
            for i in range(tiles[n, 0], tiles[n, 1]):
                starts[j * across + i + 1] += 1
    for k in range(across * down):
        starts[k + 1] += starts[k]
    place = starts[:-1].copy()
    listed = np.empty((first[-1], 2), np.int32)
    for n in order:
        entry = first[n]
        for j in range(tiles[n, 2], tiles[n, 3]):
            for i in range(tiles[n, 0], tiles[n, 1]):
                k = j * across + i
                listed[place[k], 0], listed[place[k], 1] = entry, n
                place[k] += 1
                entry += 1
    return listed


@inlined
def fall(p):
    """exp(-p) of eight p from 0 to `FARTHEST`, to 1e-4 of it: (1 - x + x^2 / 2 - ...)^32 with x = p / 32."""
    x = p * np.float32(-1 / 32)
    e = ((x * np.float32(1 / 24) + np.float32(1 / 6)) * x + np.float32(0.5)) * x * x + x + np.float32(1)
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    return e * e


@inlined
def rows_of(seen, top):
    """First and last + 1 row of pixels of a tile that a Gaussian may meet.

    Args:
        seen: (PLANE,) of `project`.
        top: first row of the tile.
    """
    half = np.float32(0.5)
    y0 = max(math.ceil(seen[1] - seen[11] - half), top)
    return y0, min(math.floor(seen[1] + seen[11] - half) + 1, top + TILE[1])


@inlined
def misses(seen, dx0, dy):
    """Whether a row of lanes, from dx0 from the mean on, lies outside of a Gaussian."""
    best = min(max(seen[12] * dy, dx0), dx0 + np.float32(LANES - 1))
    return (seen[2] * best + seen[3] * dy) * best + seen[4] * dy * dy > seen[10]


@kernel(parallel=True)
def blend(plane, colours, listed, starts, across, out, light):
    """Draw.

    Args:
        plane: of `project`.
        colours: (N, 3) float32, contiguous.
        listed, starts: of `list_entries`.
        across: tiles in a row.
        out: (3, H, W) float32 out, H and W multiples of a tile's: colours over black.
        light: (H, W) float32 out: transmittance.
    """
    width = light.shape[1]
    pixels = light.size
    out_flat, light_flat = out.reshape(-1), light.reshape(-1)
    count = starts.shape[0] - 1
    for k in prange(count):
        left, top = k % across * LANES, k // across * TILE[1]
        light_here, colours_here = np.ones(PIXELS, np.float32), np.zeros(3 * PIXELS, np.float32)
        ramp = np.empty(LANES, np.float32)
        for i in range(LANES):
            ramp[i] = left + i + np.float32(0.5)
        columns = load(ramp, 0)
        for place in range(starts[k], starts[k + 1]):
            if (place - starts[k]) % OFTEN == OFTEN - 1 and full(light_here):
                break
            n = listed[place, 1]
            seen = plane[n]
            y0, y1 = rows_of(seen, top)
            dx = columns - seen[0]
            dx0 = ramp[0] - seen[0]
            square, slant = dx * dx * seen[2], dx * seen[3]
            c0, c1, c2, o = colours[n, 0], colours[n, 1], colours[n, 2], seen[5]
            for y in range(y0, y1):
                dy = np.float32(y) + np.float32(0.5) - seen[1]
                if misses(seen, dx0, dy):
                    continue
                at = (y - top) * LANES
                a = opacity(square + slant * dy + seen[4] * dy * dy, o)
                t = load(light_here, at)
                w = shown(a, t)
                store(light_here, at, t - w)
                store(colours_here, at, load(colours_here, at) + w * c0)
                store(colours_here, PIXELS + at, load(colours_here, PIXELS + at) + w * c1)
                store(colours_here, 2 * PIXELS + at, load(colours_here, 2 * PIXELS + at) + w * c2)
        for y in range(TILE[1]):
            at, here = (top + y) * width + left, y * LANES
            store(light_flat, at, load(light_here, here))
            for q in range(3):
                store(out_flat, q * pixels + at, load(colours_here, q * PIXELS + here))


@inlined
def opacity(p, o):
    """Of eight pixels; 0 where it is faint."""
    a = fall(least(most(p, fill(np.float32(0))), fill(np.float32(FARTHEST)))) * o
    return where_less(a, fill(np.float32(FAINT)), fill(np.float32(0)), least(a, fill(np.float32(SOLID))))


@inlined
def shown(a, t):
    """What eight pixels show of an opacity; nothing where it is dark."""
    return where_less(t, fill(np.float32(DARK)), fill(np.float32(0)), a * t)


@compiled
def full(light: Any) -> Any:
    """Whether no light is left in a tile (PIXELS,)."""
    brightest = load(light, 0)
    for at in range(LANES, PIXELS, LANES):
        brightest = most(brightest, load(light, at))
    return highest(brightest) < np.float32(DARK)


@kernel(parallel=True)
def unblend(plane, colours, listed, starts, across, wish, rest, flat):
    """Derivatives of the loss in the picture, from front to back: what lies behind an entry is what all of the pixel
    shows but what has been passed.

    Args:
        plane, colours, listed, starts, across: of `blend`.
        wish: (3, H, W) float32: derivative by the colours over black.
        rest: (H, W) float32: colours over black times `wish`, plus the transmittance times the derivative by it.
        flat: (E, FLAT) float32 out, by entry.
    """
    width = rest.shape[1]
    pixels = rest.size
    wish_flat, rest_flat = wish.reshape(-1), rest.reshape(-1)
    count = starts.shape[0] - 1
    for k in prange(count):
        left, top = k % across * LANES, k // across * TILE[1]
        light = np.ones(PIXELS, np.float32)
        behind = np.empty(PIXELS, np.float32)
        for y in range(TILE[1]):
            store(behind, y * LANES, load(rest_flat, (top + y) * width + left))
        ramp = np.empty(LANES, np.float32)
        for i in range(LANES):
            ramp[i] = left + i + np.float32(0.5)
        columns = load(ramp, 0)
        ended = False
        zero, one = fill(np.float32(0)), fill(np.float32(1))
        for place in range(starts[k], starts[k + 1]):
            e, n = listed[place, 0], listed[place, 1]
            if not ended and (place - starts[k]) % OFTEN == OFTEN - 1:
                ended = full(light)
            if ended:
                for q in range(FLAT):
                    flat[e, q] = 0
                continue
            seen = plane[n]
            y0, y1 = rows_of(seen, top)
            dx = columns - seen[0]
            dx0 = ramp[0] - seen[0]
            square, slant = dx * dx * seen[2], dx * seen[3]
            c0, c1, c2, o = colours[n, 0], colours[n, 1], colours[n, 2], seen[5]
            v, vy, vyy, r, g, b = zero, zero, zero, zero, zero, zero
            for y in range(y0, y1):
                dy = np.float32(y) + np.float32(0.5) - seen[1]
                if misses(seen, dx0, dy):
                    continue
                at, here = y * width + left, (y - top) * LANES
                a = opacity(square + slant * dy + seen[4] * dy * dy, o)
                t = load(light, here)
                w = shown(a, t)
                g0, g1, g2 = load(wish_flat, at), load(wish_flat, pixels + at), load(wish_flat, 2 * pixels + at)
                d = g0 * c0 + g1 * c1 + g2 * c2
                left_over = load(behind, here) - w * d
                store(behind, here, left_over)
                store(light, here, t - w)
                # Neither what is cut off at `SOLID` nor what is not shown has a slope.
                slope = a * (t * d - left_over / (one - a))
                slope = where_less(a, fill(np.float32(SOLID)), where_less(zero, w, slope, zero), zero)
                v = v + slope
                slope = slope * dy
                vy = vy + slope
                vyy = vyy + slope * dy
                r = r + w * g0
                g = g + w * g1
                b = b + w * g2
            vx, vxy = v * dx, vy * dx
            sx, sy = total(vx), total(vy)
            flat[e, 0], flat[e, 1], flat[e, 2] = total(v), sx, sy
            flat[e, 3], flat[e, 4], flat[e, 5] = total(vx * dx), total(vxy), total(vyy)
            flat[e, 6], flat[e, 7], flat[e, 8] = total(r), total(g), total(b)
            mx, my = 2 * seen[2] * sx + seen[3] * sy, seen[3] * sx + 2 * seen[4] * sy
            flat[e, 9] = math.sqrt(mx * mx + my * my)
