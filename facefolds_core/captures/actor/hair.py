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
    span,
    value_noise,
)
from facefolds_core.kernels.jit import compiled

_CENTRE_Y, _CENTRE_Z = 25.0, -12.0
# Unit axis through the crown, and two unit vectors across it.
_AXIS: Vector = (0.20, 0.80, -0.5657)
_ACROSS_1: Vector = (0.9701, -0.2425, 0.0)
_ACROSS_2: Vector = (-0.1372, -0.5488, -0.8246)
STEP = 3.0
"""Of the march, mm. It begins on the outermost shell of the hair, so that no steps show as rings."""
_FULL = 0.17
"""Extinction of dense hair, per mm."""
_FRINGE = 5.7
"""No hair stands out farther than this from the outline, mm."""
_AROUND: Vector = (0.0, 0.0, -15.0)
_RADIUS = 151.0
"""A sphere that holds all hair, mm."""


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
def _combed(x: float, y: float, z: float) -> tuple[float, float, float, float, float]:
    """Where a point lies on the combed head: a point (a, b) of the unit circle about the axis, cosine to the axis,
    distance from the centre in mm, and how far it is from the crown, where all strands meet: 0 there, 1 away from it.
    """
    y, z = y - _CENTRE_Y, z - _CENTRE_Z
    r = max(math.sqrt(x * x + y * y + z * z), 1e-6)
    along = (x * _AXIS[0] + y * _AXIS[1] + z * _AXIS[2]) / r
    a = x * _ACROSS_1[0] + y * _ACROSS_1[1] + z * _ACROSS_1[2]
    b = x * _ACROSS_2[0] + y * _ACROSS_2[1] + z * _ACROSS_2[2]
    rho = max(math.sqrt(a * a + b * b), 1e-6)
    twist = 0.35 * along + 0.05 * math.sin(0.075 * (y + 0.4 * x))
    # Cosine and sine of what stays within 0.4, to 1e-4.
    square = twist * twist
    c, s = 1.0 - square * (0.5 - square / 24.0), twist * (1.0 - square * (1.0 / 6.0 - square / 120.0))
    return (a * c - b * s) / rho, (a * s + b * c) / rho, along, r, smoothstep(0.30, 0.75, rho / r)


@compiled
def _locks(a: float, b: float, along: float, r: float, away: float) -> float:
    """Noise of the width of a lock, in [0, 1]; even at the crown."""
    return 0.62 + (value_noise(7.0 * a, 7.0 * b, 1.6 * along + 0.035 * r, 11) - 0.62) * away


@compiled
def _strands(a: float, b: float, along: float, r: float, away: float) -> float:
    """Noise of the width of a strand, in [0, 1]."""
    fine = value_noise(27.0 * a, 27.0 * b, 2.6 * along + 0.11 * r, 12)
    finest = value_noise(68.0 * a, 68.0 * b, 3.4 * along + 0.25 * r, 13)
    return 0.5 + (0.75 * (fine - 0.5) + 0.55 * (finest - 0.5)) * away


@compiled
def roots(x: float, y: float, z: float) -> float:
    """How much of the skin the roots of the hair hide, 0 to 1: strands end at the hairline, each a little elsewhere."""
    d = envelope(x, y, z)
    if d > 4.0 or d < -14.0:
        return 1.0 if d < 0.0 else 0.0
    a, b, along, r, away = _combed(x, y, z)
    ragged = 7.0 * (_strands(a, b, along, r, away) - 0.5) + 5.0 * (_locks(a, b, along, r, away) - 0.5)
    return smoothstep(0.5, -5.0, d - ragged)


@compiled
def density(x: float, y: float, z: float, d: float, amount: float) -> tuple[float, float, float]:
    """Extinction per mm at a point, d mm from the outline, with what shading needs: (extinction, locks, strands)."""
    a, b, along, r, away = _combed(x, y, z)
    locks = _locks(a, b, along, r, away)
    inside = -(d + 6.0 * (locks - 0.45))
    body = smoothstep(-3.0, 13.0, inside)
    if body <= 0.0:
        return 0.0, locks, 0.5
    fine = _strands(a, b, along, r, away)
    # Near the outline only the thickest strands remain.
    cut = smoothstep(0.78 - 0.85 * body, 1.02 - 0.85 * body, fine)
    return amount * _FULL * body * cut, locks, fine


@compiled
def _power_32(x: float) -> float:
    """x^32 by squaring: `**` takes ten times as long."""
    x *= x
    x *= x
    x *= x
    x *= x
    return x * x


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
        shine = gloss * 0.24 * _power_32(max(1.0 - t_h * t_h, 0.0)) * (0.35 + fine)
        diffuse = 0.85 * across * facing
        red += lights[i, 3] * facing * shine + lights[i, 3] * base_r * diffuse
        green += lights[i, 4] * facing * shine * 0.85 + lights[i, 4] * base_g * diffuse
        blue += lights[i, 5] * facing * shine * 0.68 + lights[i, 5] * base_b * diffuse
    return red * shade, green * shade, blue * shade


@compiled
def reach(o: Vector, d: Vector, spread: float) -> float:
    """How far along all rays of a cone about (o, d), `spread` mm wider a mm, there is surely no hair; inf: nowhere."""
    t, far = span(o, d, _AROUND, _RADIUS, spread)
    while t < far:
        clear = envelope(o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]) - _FRINGE - spread * t
        if clear < 1.0:
            return t
        t += max(0.85 * clear, 1.0)
    return math.inf


@compiled
def march(
    o: Vector,
    d: Vector,
    near: float,
    far: float,
    lights: NDArray[np.float64],
    amount: float,
    gloss: float,
) -> tuple[float, float, float, float]:
    """Follow a ray through the hair from `near` to `far`: (red, green, blue) of the hair times its cover, and
    transmittance.
    """
    red, green, blue, through = 0.0, 0.0, 0.0, 1.0
    if amount <= 0.0:
        return red, green, blue, through
    _, leave = span(o, d, _AROUND, _RADIUS, 0.0)
    t, far = near, min(far, leave)
    while t < far:
        x, y, z = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
        outside = envelope(x, y, z)
        if outside > _FRINGE + 0.3:
            t += 0.85 * (outside - _FRINGE)
            continue
        step = min(STEP * (2.2 - 1.2 * through), far - t)
        extinction, locks, fine = density(x, y, z, outside, amount)
        if extinction <= 1e-4:
            step = 1.4 * STEP
        else:
            cover = 1.0 - math.exp(-extinction * step)
            r, g, bl = hair_colour(x, y, z, (-d[0], -d[1], -d[2]), outside, locks, fine, lights, gloss)
            red += through * cover * r
            green += through * cover * g
            blue += through * cover * bl
            through *= 1.0 - cover
            if through < 0.03:
                share = 1.0 / (1.0 - through)
                return red * share, green * share, blue * share, 0.0
        # What is deep in the hair hardly shows.
        t += step
    return red, green, blue, through
