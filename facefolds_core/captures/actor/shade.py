"""Colour of the opaque surfaces: what they are painted with, and how they answer the lights."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.clothes import shirt_paint
from facefolds_core.captures.actor.hair import envelope, roots
from facefolds_core.captures.actor.motion import BLINK, BROW, GAZE_X, GAZE_Y
from facefolds_core.captures.actor.noise import Vector, clamp, hash3, mix, smoothstep, value_noise
from facefolds_core.captures.actor.shape import (
    EYE,
    EYE_RADIUS,
    EYE_X,
    EYE_Z,
    MOUTH_HALFWIDTH,
    MOUTH_Y,
    PROP,
    SHIRT,
    SKIN,
    TEETH,
    distance,
    eye_slot,
    lid_edges,
    mouth_gap,
    to_rest,
)
from facefolds_core.kernels.jit import compiled


@compiled
def _freckles(x: float, y: float, z: float) -> float:
    """Darkness of freckles in [0, 1]: at most one dot a cell of 4.5 mm."""
    cell = 4.5
    i, j, k = math.floor(x / cell), math.floor(y / cell), math.floor(z / cell)
    if hash3(i, j, k, 21) > 0.34:
        return 0.0
    dx = x / cell - i - 0.3 - 0.4 * hash3(i, j, k, 22)
    dy = y / cell - j - 0.3 - 0.4 * hash3(i, j, k, 23)
    dz = z / cell - k - 0.3 - 0.4 * hash3(i, j, k, 24)
    size = 0.14 + 0.18 * hash3(i, j, k, 25)
    return smoothstep(size, 0.5 * size, math.sqrt(dx * dx + dy * dy + dz * dz))


@compiled
def lip_mask(xr: float, yr: float) -> float:
    """How red the skin is at a point of the rest face, 0 to 1."""
    ax = abs(xr)
    s = ax / (MOUTH_HALFWIDTH + 0.5)
    taper = max(1.0 - s * s, 0.0) ** 0.75
    bow = 1.9 * math.exp(-(((ax - 5.5) / 4.0) ** 2)) - 0.8 * math.exp(-((ax / 2.5) ** 2))
    upper = MOUTH_Y + (7.6 + bow) * taper
    lower = MOUTH_Y - 9.6 * taper
    inside = min(upper - yr, yr - lower)
    return smoothstep(-0.9, 0.9, inside) * smoothstep(1.02, 0.92, s)


@compiled
def brow_mask(xr: float, yr: float, zr: float, brow: float) -> float:
    """Density of the eyebrow, 0 to 1."""
    ax = abs(xr)
    s = (ax - 12.0) / 37.0
    if s < -0.1 or s > 1.1 or zr < 30.0:
        return 0.0
    centre = 18.0 + 3.5 * brow + 6.5 * math.sin(math.pi * clamp(s, 0.0, 1.0) ** 1.25) - 3.0 * s
    halfwidth = 3.6 * (1.0 - 0.62 * s)
    across = abs(yr - centre) / max(halfwidth, 0.3)
    # Hairs lean outwards.
    hairs = value_noise((ax - 0.6 * (yr - centre)) / 1.1, yr / 4.0, 0.5, 31)
    fade = smoothstep(1.25, 0.55, across) * smoothstep(-0.08, 0.1, s) * smoothstep(1.08, 0.85, s)
    return fade * (0.62 + 0.38 * hairs)


@compiled
def _skin_paint(x: float, y: float, z: float, pose: NDArray[np.float64]) -> tuple[Vector, float]:
    """Albedo of the skin at a point of the moving head, and its gloss."""
    xr, yr, zr = to_rest(x, y, z, pose)
    ax = abs(xr)
    broad = value_noise(xr / 17.0, yr / 17.0, zr / 17.0, 1) - 0.5
    fine = value_noise(xr / 3.1, yr / 3.1, zr / 3.1, 2) - 0.5
    tone = 1.0 + 0.07 * broad + 0.07 * fine
    colour = (0.90 * tone, 0.67 * tone, 0.545 * tone)
    gloss = 0.30 + 0.25 * fine
    # Blood: cheeks, tip of the nose, chin.
    red = 0.75 * math.exp(-(((ax - 40.0) / 17.0) ** 2) - ((yr + 32.0) / 16.0) ** 2)
    red += 0.65 * math.exp(-((ax / 10.0) ** 2) - ((yr + 39.0) / 10.0) ** 2)
    red += 0.25 * math.exp(-((ax / 14.0) ** 2) - ((yr + 102.0) / 9.0) ** 2)
    if zr > 20.0:
        colour = mix(colour, (0.86, 0.47, 0.40), 0.42 * red)
        around = math.exp(-((((ax - EYE_X) / 17.0) ** 2 + ((yr - 1.0) / 11.0) ** 2) ** 2))
        colour = mix(colour, (0.66, 0.42, 0.36), 0.26 * around)
        gloss += 0.30 * math.exp(-((ax / 9.0) ** 2)) * smoothstep(-48.0, -30.0, yr)
        where = math.exp(-(((yr + 24.0) / 22.0) ** 2)) * smoothstep(64.0, 40.0, ax)
        dots = _freckles(xr, yr, zr) * (0.08 + 0.40 * where)
        colour = mix(colour, (0.50, 0.27, 0.17), dots)
        brow = brow_mask(xr, yr, zr, pose[BROW])
        colour = mix(colour, (0.17, 0.095, 0.055), 0.92 * brow)
        gloss *= 1.0 - 0.7 * brow
    if zr > 40.0 and yr < -40.0:
        lip = lip_mask(xr, yr)
        wrinkle = value_noise(xr / 1.3, yr / 7.0, 0.5, 3)
        colour = mix(colour, (0.70 + 0.06 * wrinkle, 0.35, 0.32), 0.74 * lip)
        gloss += 0.40 * lip * (0.5 + wrinkle)
        height, edge, _ = mouth_gap(x, pose)
        if abs(x) < MOUTH_HALFWIDTH + 3.0:
            line = abs(y - edge) if height < 1.0 else 99.0
            colour = mix(colour, (0.22, 0.07, 0.06), 0.85 * smoothstep(1.5, 0.3, line) * smoothstep(26.0, 22.0, ax))
            if abs(y - edge + 0.5 * height) < 0.5 * height - 0.3 and z < 84.0:
                # Inside the mouth.
                colour = mix((0.42, 0.10, 0.10), (0.10, 0.02, 0.02), smoothstep(84.0, 60.0, z))
                gloss = 0.2
    if abs(y) < 18.0 and z > 50.0:
        colour, gloss = _lid_paint(abs(x) - EYE_X, y, pose[BLINK], colour, gloss)
    # Nostrils and the scalp under the hair are dark.
    nostril = math.exp(-(((ax - 6.2) / 3.0) ** 2) - ((yr + 45.5) / 1.8) ** 2) * smoothstep(85.0, 88.0, zr)
    nostril *= smoothstep(98.0, 95.0, zr)
    colour = mix(colour, (0.20, 0.07, 0.05), 0.9 * clamp(1.4 * nostril, 0.0, 1.0))
    scalp = roots(x, y, z)
    return mix(colour, (0.17, 0.10, 0.06), 0.9 * scalp), gloss * (1.0 - scalp)


@compiled
def _lid_paint(ex: float, y: float, blink: float, colour: Vector, gloss: float) -> tuple[Vector, float]:
    """Lashes along the upper lid's edge, a pink lower rim."""
    lower, upper = lid_edges(ex, blink)
    slot = eye_slot(ex, y, blink)
    lash = smoothstep(2.2 + 0.5 * blink, 0.8, slot) * smoothstep(16.0, 12.5, abs(ex))
    if y > 0.5 * (lower + upper) - 1.2 * blink:
        colour = mix(colour, (0.10, 0.055, 0.04), 0.93 * lash)
    else:
        rim = smoothstep(1.5, 0.4, slot)
        colour = mix(colour, (0.62, 0.34, 0.30), 0.7 * rim)
        colour = mix(colour, (0.16, 0.09, 0.07), 0.5 * rim * smoothstep(2.0, 11.0, ex))
    return colour, gloss * (1.0 - 0.5 * lash)


@compiled
def _eye_paint(x: float, y: float, z: float, pose: NDArray[np.float64]) -> Vector:
    """Sclera, iris with fibres, pupil; darker under the upper lid."""
    side = 1.0 if x > 0 else -1.0
    ex, ey, ez = (x - side * EYE_X) / EYE_RADIUS, y / EYE_RADIUS, (z - EYE_Z) / EYE_RADIUS
    gx, gy = pose[GAZE_X] - 0.035 * side, pose[GAZE_Y] + 0.02
    ux = ex * math.cos(gx) - ez * math.sin(gx)
    uz = ex * math.sin(gx) + ez * math.cos(gx)
    uy = ey * math.cos(gy) - uz * math.sin(gy)
    radius = math.sqrt(ux * ux + uy * uy) * EYE_RADIUS
    temple = side * ex * EYE_RADIUS
    colour = mix((0.90, 0.875, 0.85), (0.80, 0.58, 0.53), smoothstep(6.0, 14.0, abs(temple)))
    if radius < 7.8:
        angle = math.atan2(uy, ux)
        fibre = value_noise(3.0 * math.cos(angle) * 3.0, 3.0 * math.sin(angle) * 3.0, radius / 3.0, 41)
        iris = mix((0.50, 0.36, 0.16), (0.16, 0.36, 0.40), smoothstep(2.4, 4.6, radius + 1.2 * fibre))
        light = 0.75 + 0.6 * fibre
        iris = (iris[0] * light, iris[1] * light, iris[2] * light)
        iris = mix(iris, (0.05, 0.07, 0.08), smoothstep(5.6, 7.0, radius))
        iris = mix((0.015, 0.012, 0.012), iris, smoothstep(2.3, 2.9, radius))
        colour = mix(iris, colour, smoothstep(6.8, 7.6, radius))
    slot = -eye_slot(temple, y, pose[BLINK])
    shadow = smoothstep(0.0, 4.5, slot) if y > 0.0 else smoothstep(0.0, 1.5, slot)
    light = 0.50 + 0.50 * shadow
    return colour[0] * light, colour[1] * light, colour[2] * light


@compiled
def _teeth_paint(x: float, y: float, z: float) -> Vector:
    """Ivory, a dark line between neighbours, darker to the back."""
    angle = math.atan2(x, max(z - 64.0, 0.1)) * 21.0
    gap = abs((angle / 7.0) % 1.0 - 0.5) * 2.0
    light = (1.0 - 0.30 * smoothstep(0.9, 1.0, 1.0 - gap)) * (0.45 + 0.60 * smoothstep(68.0, 82.0, z))
    return 0.93 * light, 0.89 * light, 0.80 * light


@compiled
def paint(x: float, y: float, z: float, material: int, pose: NDArray[np.float64]) -> tuple[Vector, float, float]:
    """(albedo, strength of the gloss, its exponent) at a point of a material."""
    if material == SKIN:
        colour, gloss = _skin_paint(x, y, z, pose)
        return colour, gloss, 26.0
    if material == EYE:
        return _eye_paint(x, y, z, pose), 2.6, 260.0
    if material == TEETH:
        return _teeth_paint(x, y, z), 0.6, 60.0
    if material == SHIRT:
        return shirt_paint(x, y, z), 0.05, 10.0
    if material == PROP:
        stripe = smoothstep(-0.3, 0.3, math.sin(0.45 * (x + y)))
        return mix((0.82, 0.68, 0.16), (0.14, 0.34, 0.30), stripe), 0.1, 20.0
    return (0.66, 0.27, 0.27), 0.5, 40.0


@compiled
def occlusion(x: float, y: float, z: float, n: Vector, pose: NDArray[np.float64]) -> float:
    """Ambient light that reaches a point, 0 to 1: how far the surface recedes along its normal (three probes)."""
    blocked, weight = 0.0, 1.0
    for i in range(3):
        h = 2.5 + 6.0 * i
        blocked += weight * max(h - distance(x + h * n[0], y + h * n[1], z + h * n[2], pose), 0.0) / h
        weight *= 0.6
    return clamp(1.0 - 0.75 * blocked, 0.0, 1.0)


@compiled
def shadow(x: float, y: float, z: float, lx: float, ly: float, lz: float, pose: NDArray[np.float64]) -> float:
    """Soft shadow towards a light, 0 to 1 (Quilez's penumbra estimate)."""
    lit, t = 1.0, 4.0
    for _ in range(6):
        d = distance(x + t * lx, y + t * ly, z + t * lz, pose)
        lit = min(lit, 5.0 * d / t)
        if lit < 0.02 or t > 60.0:
            break
        t += clamp(d, 4.0, 25.0)
    return smoothstep(0.0, 1.0, lit)


@compiled
def surface_colour(
    p: Vector,
    n: Vector,
    view: Vector,
    material: int,
    pose: NDArray[np.float64],
    lights: NDArray[np.float64],
    gloss: float,
) -> Vector:
    """Colour of an opaque point towards the eye: wrapped diffuse, Blinn-Phong gloss, occlusion, the key light's shadow.

    Args:
        p: point, head mm.
        n: unit normal.
        view: unit vector to the eye.
        lights: (L, 6) unit direction to the light, colour; the first one casts shadows.
        gloss: factor on every gloss.
    """
    albedo, shine, exponent = paint(p[0], p[1], p[2], material, pose)
    open_sky = occlusion(p[0], p[1], p[2], n, pose)
    under_hair = 0.55 + 0.45 * smoothstep(-4.0, 8.0, envelope(p[0], p[1], p[2]))
    # Light scattered in skin reddens where it grazes.
    wrap = 0.30 if material == SKIN else 0.1
    up = 0.5 + 0.5 * n[1]
    red = albedo[0] * (0.27 + 0.13 * up) * open_sky
    green = albedo[1] * (0.25 + 0.15 * up) * open_sky
    blue = albedo[2] * (0.24 + 0.17 * up) * open_sky
    for i in range(lights.shape[0]):
        lx, ly, lz = lights[i, 0], lights[i, 1], lights[i, 2]
        cosine = n[0] * lx + n[1] * ly + n[2] * lz
        lit = 0.4 + 0.6 * open_sky
        if i == 0 and cosine > -wrap:
            lit *= 0.40 + 0.60 * shadow(p[0], p[1], p[2], lx, ly, lz, pose)
        soft = clamp((cosine + wrap) / (1.0 + wrap), 0.0, 1.0)
        hard = clamp((cosine + 0.1) / 1.1, 0.0, 1.0)
        hx, hy, hz = lx + view[0], ly + view[1], lz + view[2]
        h = max(math.sqrt(hx * hx + hy * hy + hz * hz), 1e-6)
        highlight = max((n[0] * hx + n[1] * hy + n[2] * hz) / h, 0.0) ** exponent
        highlight *= gloss * shine * smoothstep(-0.05, 0.15, cosine) * lit
        red += lights[i, 3] * (albedo[0] * soft * lit + highlight)
        green += lights[i, 4] * (albedo[1] * (0.35 * soft + 0.65 * hard) * lit + highlight)
        blue += lights[i, 5] * (albedo[2] * (0.25 * soft + 0.75 * hard) * lit + highlight)
    return red * under_hair, green * under_hair, blue * under_hair
