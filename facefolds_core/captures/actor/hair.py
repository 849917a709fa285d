"""Volumetric hair: a density around the skull, combed into strands, marched with absorption.

The envelope is a signed distance; the density rises from its edge inwards, cut into locks and strands by noise that is
drawn out along the strands, so that the outline is thin and semi-transparent. Strands run along the meridians of an
axis through the crown, slightly twisted.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.noise import (
    Vector,
    clamp,
    ellipsoid,
    smooth_max,
    smooth_min,
    smoothstep,
    value_noise,
)
from facefolds_core.jit import compiled

_CENTRE_Y, _CENTRE_Z = 25.0, -12.0
# Unit axis through the crown, and two unit vectors across it.
_AXIS: Vector = (0.20, 0.80, -0.5657)
_ACROSS_1: Vector = (0.9701, -0.2425, 0.0)
_ACROSS_2: Vector = (-0.1372, -0.5488, -0.8246)
STEP = 2.5
_FULL = 0.17
"""Extinction of dense hair, per mm."""


@compiled
def envelope(x: float, y: float, z: float) -> float:
    """Signed distance to the outline of the hair (without strands), mm."""
    ax = abs(x)
    d = ellipsoid(x, y - 33.0, z + 12.0, 88.0, 98.0, 108.0)
    side = ellipsoid(ax - 66.0, y + 42.0, z + 22.0, 27.0, 88.0, 52.0)
    d = smooth_min(d, side, 22.0)
    d = smooth_min(d, ellipsoid(x, y + 40.0, z + 58.0, 84.0, 90.0, 48.0), 25.0)
    # The face stays free: an oval that leans back at the hairline, higher on the side of the parting.
    hairline = 56.0 + 9.0 * math.exp(-(((x - 18.0) / 26.0) ** 2))
    face = ellipsoid(x, y + 22.0, z - 100.0, 66.0, 22.0 + hairline, 84.0)
    return smooth_max(d, -face, 8.0)


@compiled
def strands(x: float, y: float, z: float, seed: int) -> tuple[float, float]:
    """Noise combed along the hair at a point: (locks, strands), both in [0, 1]."""
    y, z = y - _CENTRE_Y, z - _CENTRE_Z
    r = max(math.sqrt(x * x + y * y + z * z), 1e-6)
    along = (x * _AXIS[0] + y * _AXIS[1] + z * _AXIS[2]) / r
    a = x * _ACROSS_1[0] + y * _ACROSS_1[1] + z * _ACROSS_1[2]
    b = x * _ACROSS_2[0] + y * _ACROSS_2[1] + z * _ACROSS_2[2]
    rho = max(math.sqrt(a * a + b * b), 1e-6)
    twist = 0.35 * along + 0.05 * math.sin(0.075 * (y + 0.4 * x))
    c, s = math.cos(twist), math.sin(twist)
    a, b = (a * c - b * s) / rho, (a * s + b * c) / rho
    locks = value_noise(7.0 * a, 7.0 * b, 1.6 * along + 0.035 * r, seed + 11)
    # The meridians meet at the crown: no locks there.
    away = smoothstep(0.30, 0.75, rho / r)
    locks = 0.62 + (locks - 0.62) * away
    fine = value_noise(27.0 * a, 27.0 * b, 2.6 * along + 0.11 * r, seed + 12)
    finest = value_noise(68.0 * a, 68.0 * b, 3.4 * along + 0.25 * r, seed + 13)
    fine = 0.5 + (0.75 * (fine - 0.5) + 0.55 * (finest - 0.5)) * away
    return locks, fine


@compiled
def density(x: float, y: float, z: float, amount: float, seed: int) -> tuple[float, float, float, float]:
    """Extinction per mm at a point, with what shading needs: (extinction, depth below the outline, locks, strands)."""
    d = envelope(x, y, z)
    if d > 10.0:
        return 0.0, d, 0.5, 0.5
    locks, fine = strands(x, y, z, seed)
    inside = -(d + 9.0 * (locks - 0.45))
    body = smoothstep(-6.0, 15.0, inside)
    if body <= 0.0:
        return 0.0, d, locks, fine
    # Near the outline only the thickest strands remain.
    cut = smoothstep(0.78 - 0.85 * body, 1.02 - 0.85 * body, fine)
    return amount * _FULL * body * cut, d, locks, fine


@compiled
def hair_colour(
    x: float,
    y: float,
    z: float,
    view: Vector,
    depth: float,
    locks: float,
    fine: float,
    lights: NDArray[np.float64],
    gloss: float,
) -> Vector:
    """Colour of a strand: Kajiya and Kay's diffuse and specular terms about the strand's direction.

    Args:
        view: unit vector from the point to the eye, head frame.
        depth: signed distance to the outline (negative inside): light fades inwards.
        lights: (L, 6) direction to the light, colour; head frame.
    """
    py, pz = y - _CENTRE_Y, z - _CENTRE_Z
    r = max(math.sqrt(x * x + py * py + pz * pz), 1e-6)
    nx, ny, nz = x / r, py / r, pz / r
    along = nx * _AXIS[0] + ny * _AXIS[1] + nz * _AXIS[2]
    tx, ty, tz = _AXIS[0] - along * nx, _AXIS[1] - along * ny, _AXIS[2] - along * nz
    tilt = 0.5 * (fine - 0.5) + 0.35 * (locks - 0.5)
    tx, ty, tz = tx + tilt * nx, ty + tilt * ny, tz + tilt * nz
    length = max(math.sqrt(tx * tx + ty * ty + tz * tz), 1e-6)
    tx, ty, tz = tx / length, ty / length, tz / length
    shade = 0.25 + 0.75 * smoothstep(-26.0, 2.0, depth) * (0.55 + 0.75 * locks)
    tone = 0.35 + 1.15 * fine
    base_r, base_g, base_b = 0.34 * tone + 0.05 * locks, 0.19 * tone + 0.03 * locks, 0.095 * tone + 0.015 * locks
    red, green, blue = 0.30 * base_r, 0.30 * base_g, 0.30 * base_b
    for i in range(lights.shape[0]):
        lx, ly, lz = lights[i, 0], lights[i, 1], lights[i, 2]
        facing = clamp(0.45 + 0.75 * (lx * nx + ly * ny + lz * nz), 0.0, 1.0)
        t_l = tx * lx + ty * ly + tz * lz
        across = math.sqrt(max(1.0 - t_l * t_l, 0.0))
        hx, hy, hz = lx + view[0], ly + view[1], lz + view[2]
        h = max(math.sqrt(hx * hx + hy * hy + hz * hz), 1e-6)
        t_h = (tx * hx + ty * hy + tz * hz) / h
        shine = gloss * 0.22 * max(1.0 - t_h * t_h, 0.0) ** 30 * (0.35 + fine)
        diffuse = 0.85 * across * facing
        red += lights[i, 3] * facing * shine + lights[i, 3] * base_r * diffuse
        green += lights[i, 4] * facing * shine * 0.85 + lights[i, 4] * base_g * diffuse
        blue += lights[i, 5] * facing * shine * 0.68 + lights[i, 5] * base_b * diffuse
    return red * shade, green * shade, blue * shade
