"""The room behind the head: a box of painted walls in world millimetres (x right, y down), still in every frame."""

from __future__ import annotations

import math

from facefolds_core.captures.actor.noise import Vector, clamp, hash3, mix, smoothstep, value_noise
from facefolds_core.kernels.jit import compiled

_LEFT, _RIGHT = -1900.0, 1900.0
_CEILING, _FLOOR = -1250.0, 1350.0
_FRONT, _BACK = -900.0, 2700.0
_TILE = 110.0


@compiled
def _inside(u: float, v: float, u0: float, u1: float, v0: float, v1: float) -> bool:
    return u0 < u < u1 and v0 < v < v1


@compiled
def _back_wall(u: float, v: float) -> Vector:
    """Blue-green plaster, two framed pictures, a shelf board, a panel below."""
    tone = 0.92 + 0.12 * value_noise(u / 260.0, v / 260.0, 0.5, 3)
    colour = (0.36 * tone, 0.52 * tone, 0.53 * tone)
    if v > 330.0:
        groove = abs(((u / 230.0) % 1.0) - 0.5) * 2.0
        shade = 0.72 if groove > 0.95 else 0.9
        colour = (0.80 * shade, 0.77 * shade, 0.70 * shade)
        if v < 365.0:
            colour = (0.88, 0.86, 0.80)
    if _inside(u, v, -640.0, -180.0, -420.0, 180.0):
        colour = (0.28, 0.18, 0.11)
        if _inside(u, v, -610.0, -210.0, -390.0, 150.0):
            hill = -40.0 + 60.0 * math.sin(u / 95.0) + 25.0 * math.sin(u / 37.0)
            colour = mix((0.93, 0.72, 0.45), (0.62, 0.72, 0.86), smoothstep(hill, -390.0, v))
            if v > hill:
                colour = mix((0.30, 0.42, 0.24), (0.17, 0.27, 0.20), smoothstep(hill, 150.0, v))
    if _inside(u, v, 250.0, 560.0, -330.0, 20.0):
        colour = (0.90, 0.88, 0.82)
        radius = math.sqrt((u - 405.0) ** 2 + (v + 155.0) ** 2)
        if radius < 115.0:
            colour = mix((0.86, 0.42, 0.25), (0.95, 0.74, 0.36), smoothstep(115.0, 20.0, radius))
    return colour


@compiled
def _left_wall(u: float, v: float) -> Vector:
    """Warm wall with a bright window; u runs along z."""
    tone = 0.94 + 0.1 * value_noise(u / 300.0, v / 300.0, 0.5, 5)
    colour = (0.78 * tone, 0.62 * tone, 0.44 * tone)
    if _inside(u, v, 1050.0, 1900.0, -700.0, 330.0):
        colour = (0.92, 0.90, 0.86)
        a, b = (u - 1050.0) / 425.0 % 1.0, (v + 700.0) / 515.0 % 1.0
        if 0.08 < a < 0.92 and 0.07 < b < 0.93:
            colour = mix((0.93, 0.97, 1.0), (0.62, 0.80, 0.96), smoothstep(200.0, -700.0, v))
            if v > 120.0 + 40.0 * math.sin(u / 70.0):
                colour = (0.42, 0.58, 0.36)
    return colour


@compiled
def _right_wall(u: float, v: float) -> Vector:
    """A bookcase; u runs along z."""
    j = math.floor((v + 1250.0) / 330.0)
    height = (v + 1250.0) - 330.0 * j
    if height < 28.0:
        return (0.45, 0.31, 0.20)
    along = u / 58.0 + 0.4 * j
    k = math.floor(along)
    top = 60.0 + 95.0 * hash3(k, j, 1, 7)
    if height < top:
        return (0.20, 0.15, 0.12)
    spine = abs(along - k - 0.5) * 2.0
    shade = 1.0 - 0.45 * spine**6
    hue = hash3(k, j, 2, 7)
    if hue < 0.25:
        colour = (0.62, 0.24, 0.20)
    elif hue < 0.5:
        colour = (0.22, 0.36, 0.50)
    elif hue < 0.75:
        colour = (0.76, 0.66, 0.45)
    else:
        colour = (0.28, 0.42, 0.30)
    light = shade * (0.75 + 0.5 * hash3(k, j, 3, 7))
    if abs(height - 190.0) < 14.0 and hash3(k, j, 4, 7) > 0.4:
        light *= 1.4
    return colour[0] * light, colour[1] * light, colour[2] * light


@compiled
def _floor(u: float, v: float) -> Vector:
    """Planks along z."""
    plank = math.floor(u / 150.0)
    tone = 0.8 + 0.3 * hash3(plank, 0, 0, 9) + 0.12 * (value_noise(u / 18.0, v / 240.0, 0.5, 9) - 0.5)
    if (u / 150.0) % 1.0 < 0.035:
        tone *= 0.6
    return 0.56 * tone, 0.39 * tone, 0.25 * tone


@compiled
def _ceiling(u: float, v: float) -> Vector:
    radius = math.sqrt(u * u + (v - 1500.0) ** 2)
    return mix((1.0, 0.97, 0.90), (0.80, 0.79, 0.77), smoothstep(240.0, 300.0, radius))


@compiled
def room_colour(o: Vector, d: Vector, clutter: float) -> Vector:
    """Colour of the wall that a ray meets from inside the room.

    Args:
        o: origin, world mm.
        d: direction.
        clutter: 0 as painted, 1 hung with tiles of random colours.
    """
    (ox, oy, oz), (dx, dy, dz) = o, d
    tx = ((_RIGHT if dx > 0 else _LEFT) - ox) / dx if abs(dx) > 1e-9 else math.inf
    ty = ((_FLOOR if dy > 0 else _CEILING) - oy) / dy if abs(dy) > 1e-9 else math.inf
    tz = ((_BACK if dz > 0 else _FRONT) - oz) / dz if abs(dz) > 1e-9 else math.inf
    t = min(tx, ty, tz)
    x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
    if t == tx:
        colour = _right_wall(z, y) if dx > 0 else _left_wall(z, y)
    elif t == ty:
        colour = _floor(x, z) if dy > 0 else _ceiling(x, z)
    else:
        colour = _back_wall(x, y)
    if clutter > 0.0:
        i, j, k = math.floor(x / _TILE), math.floor(y / _TILE), math.floor(z / _TILE)
        tile = (hash3(i, j, k, 21), hash3(i, j, k, 22), hash3(i, j, k, 23))
        colour = mix(colour, tile, clutter)
    # Darker towards edges and corners of the room.
    gap_x, gap_y, gap_z = min(x - _LEFT, _RIGHT - x), min(y - _CEILING, _FLOOR - y), min(z - _FRONT, _BACK - z)
    middle = gap_x + gap_y + gap_z - min(gap_x, gap_y, gap_z) - max(gap_x, gap_y, gap_z)
    light = 0.62 + 0.3 * smoothstep(0.0, 700.0, middle)
    red, green, blue = colour
    return clamp(red * light, 0.0, 1.0), clamp(green * light, 0.0, 1.0), clamp(blue * light, 0.0, 1.0)
