"""The head as a signed distance function, in its own frame: millimetres, x to its left, y up, z forward.

The eyes lie at y = 0, the mouth at y = -67, the chin at y = -114, the top of the skull at y = 115. Distances are
approximate (blended ellipsoids), right to first order at the surface and never much too long, so that sphere tracing
with a shortened step finds the first crossing.

Jaw, smile and pucker move the face by a warp: a point is carried back to the rest pose and measured there. The mouth
and the eyes open as slots cut into the skin.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.clothes import CUT_MARGIN, bust, shirt
from facefolds_core.captures.actor.motion import BALL, BLINK, BROW, JAW, NOSE, PUCKER, SMILE
from facefolds_core.captures.actor.noise import Vector, clamp, cone, ellipsoid, smooth_max, smooth_min, smoothstep, span
from facefolds_core.kernels.jit import compiled

AROUND: Vector = (0.0, -25.0, 20.0)
RADIUS = 240.0
"""A sphere that holds all that is opaque, mm; a prop before the face, too."""

SKIN, EYE, TEETH, TONGUE, SHIRT, PROP = range(6)
"""Materials."""

EYE_X, EYE_Z, EYE_RADIUS = 32.0, 68.5, 13.5
_LID_RADIUS = 15.0
_EYE_HALFWIDTH = 14.8
MOUTH_Y = -67.0
MOUTH_HALFWIDTH = 25.0
_JAW_DROP = 16.0
BALL_X, BALL_Y, BALL_Z = 22.0, -62.0, 168.0
"""Centre of the ball before the mouth, some 70 mm in front of the lips."""


@compiled
def lid_edges(ex: float, blink: float) -> tuple[float, float]:
    """y of the lower and of the upper lid's edge, mm.

    Args:
        ex: from the eye's centre towards the temple, mm.
        blink: 0 open, 1 shut.
    """
    s = ex / _EYE_HALFWIDTH
    lens = max(1.0 - s * s, -1.5)
    lower = -4.6 * lens
    # The upper lid is fullest a little towards the nose.
    upper = 6.9 * lens * (1.0 - 0.10 * s)
    upper += (lower - 0.4 - upper) * blink
    # The outer corner lies a little higher.
    return lower + 0.07 * ex, upper + 0.07 * ex


@compiled
def eye_slot(ex: float, ey: float, blink: float) -> float:
    """Signed distance, in the plane of the face, to the opening between the lids: negative inside, mm."""
    lower, upper = lid_edges(ex, blink)
    slope = math.sqrt(1.0 + (0.75 * ex / _EYE_HALFWIDTH) ** 2)
    # Beyond the corners there is no slot, even where the lids' edges would meet.
    return max(max(ey - upper, lower - ey) / slope, 0.8 * (abs(ex) - _EYE_HALFWIDTH))


@compiled
def mouth_gap(x: float, pose: NDArray[np.float64]) -> tuple[float, float, float]:
    """The opening of the mouth at x: (height in mm, y of its upper edge, half its width)."""
    half = MOUTH_HALFWIDTH - 3.0 * pose[JAW] + 3.5 * pose[SMILE] - 7.5 * pose[PUCKER]
    s = x / half
    height = _JAW_DROP * pose[JAW] * max(1.0 - s * s, 0.0) ** (0.75 - 0.2 * pose[PUCKER])
    return height, MOUTH_Y + 1.5 * pose[JAW] * max(1.0 - s * s, 0.0) + 4.0 * pose[SMILE] * s * s, half


@compiled
def to_rest(x: float, y: float, z: float, pose: NDArray[np.float64]) -> Vector:
    """Carry a point of the moving face back to the rest pose."""
    if z > -20.0 and y < MOUTH_Y + 5.0 and pose[JAW] > 0.0:
        height, edge, _ = mouth_gap(x, pose)
        if y < edge - 0.5 * height:
            drop = _JAW_DROP * pose[JAW]
            below = edge - height - y
            shift = height + (drop - height) * smoothstep(0.0, 55.0, below)
            shift *= smoothstep(-20.0, 55.0, z) * smoothstep(-215.0, -140.0, y)
            y += shift
            z += 0.22 * shift
    if z > 20.0 and y < 15.0:
        ax = abs(x)
        # Rounded lips are narrower and stand out.
        if pose[PUCKER] > 0.0 and y < -20.0:
            pucker = pose[PUCKER] * math.exp(-((ax / 30.0) ** 2) - ((y - MOUTH_Y) / 17.0) ** 2)
            x *= 1.0 + 0.38 * pucker
            z -= 6.5 * pucker
        smile = pose[SMILE] * math.exp(-(((ax - 27.0) / 17.0) ** 2) - ((y - MOUTH_Y - 3.0) / 15.0) ** 2)
        x -= math.copysign(3.5, x) * smile
        y -= 4.0 * smile
        z += 2.0 * smile
        cheek = pose[SMILE] * math.exp(-(((ax - 38.0) / 17.0) ** 2) - ((y + 32.0) / 15.0) ** 2)
        z -= 2.5 * cheek
        y -= 1.5 * cheek
    return x, y, z


@compiled
def _nose(ax: float, y: float, z: float, longer: float, d: float) -> float:
    """Blend the nose, by `longer` mm longer than usual, into the skin distance d."""
    d = smooth_min(d, cone(ax, y, z, 12.0, 81.0, -32.0, 97.0 + longer, 5.0, 8.0), 12.0)
    d = smooth_min(d, ellipsoid(ax, y + 35.5, z - 99.5 - longer, 9.5, 8.4, 9.5), 7.0)
    d = smooth_min(d, ellipsoid(ax - 11.0, y + 39.5, z - 90.0, 6.2, 6.6, 9.0), 5.0)
    return smooth_max(d, -ellipsoid(ax - 6.6, y + 47.5, z - 92.5, 2.6, 3.4, 4.0), 2.0)


@compiled
def _lips(ax: float, y: float, z: float, d: float) -> float:
    """Blend the lips into the skin distance d: two bent tubes that touch along the line of the mouth."""
    zc = 90.0 - 0.0185 * ax * ax
    s = ax / (MOUTH_HALFWIDTH + 2.0)
    if s > 1.0:
        return d
    taper = 1.0 - s * s
    bow = 1.6 * math.exp(-(((ax - 6.0) / 4.5) ** 2))
    upper = math.sqrt((y - MOUTH_Y - 3.9 * taper - 0.5 * bow) ** 2 + (z - zc + 1.5) ** 2) - 4.4 * taper
    lower = math.sqrt((y - MOUTH_Y + 5.2 * taper) ** 2 + (z - zc + 1.3) ** 2) - 5.6 * taper
    return smooth_min(d, min(upper, lower), 4.0 * taper + 0.1)


@compiled
def _jaw(ax: float, y: float, z: float) -> float:
    """The lower jaw: a tapering bar from below the ear to beside the chin."""
    px, py, pz = ax - 47.0, y + 66.0, z + 2.0
    dx, dy, dz = -33.0, -33.0, 60.0
    t = clamp((px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz), 0.0, 1.0)
    return math.sqrt((px - t * dx) ** 2 + (py - t * dy) ** 2 + (pz - t * dz) ** 2) - (14.0 - 2.0 * t)


@compiled
def _eye_region(ax: float, y: float, z: float, brow: float, d: float) -> float:
    """Blend brow ridge, eye socket and the closed lids into the skin distance d."""
    d = smooth_min(d, ellipsoid(ax - 25.0, y - 20.5 - 3.0 * brow, z - 71.0, 25.0, 9.0, 14.0), 16.0)
    ex = ax - EYE_X
    d = smooth_max(d, -ellipsoid(ex, y - 1.0, z - 96.0, 19.0, 12.5, 15.0), 12.0)
    d = smooth_min(d, math.sqrt(ex * ex + y * y + (z - EYE_Z) ** 2) - _LID_RADIUS, 5.0)
    # The fold above the upper lid.
    crease = (y - 9.8 - 1.5 * brow + 0.012 * ex * ex) / 1.5
    if abs(crease) < 3.0 and z > 60.0:
        d += 0.9 * math.exp(-crease * crease - (ex / 14.0) ** 4) * smoothstep(60.0, 72.0, z)
    return d


@compiled
def skin_rest(x: float, y: float, z: float, brow: float, longer: float) -> float:
    """Signed distance to the closed skin (no slots) at rest, mm, with a nose that is `longer` mm longer than usual."""
    d = ellipsoid(x, y - 32.0, z + 8.0, 73.0, 83.0, 97.0)
    d = smooth_min(d, ellipsoid(x, y + 38.0, z - 18.0, 57.0, 72.0, 66.0), 28.0)
    ax = math.sqrt(x * x + 0.5)
    neck = cone(x, y, z, -60.0, -24.0, -230.0, -40.0, 44.0, 52.0)
    d = smooth_min(d, neck, 18.0)
    d = smooth_min(d, _jaw(ax, y, z), 22.0)
    if d > 65.0 + longer:
        # The features stand out from this by less than 25 mm, the nose by what it is longer.
        return d - (25.0 + longer if z > 5.0 else 5.0)
    if z < -12.0:
        return d
    # Each feature is measured only where it can change the blend.
    if y < 30.0:
        d = smooth_min(d, ellipsoid(ax - 39.0, y + 27.0, z - 48.0, 23.0, 20.0, 26.0), 20.0)
    if y > -50.0:
        d = smooth_min(d, ellipsoid(ax - 47.0, y - 3.0, z - 40.0, 17.0, 22.0, 24.0), 16.0)
    if y < 10.0:
        d = smooth_min(d, ellipsoid(ax - 34.0, y + 58.0, z - 42.0, 22.0, 24.0, 27.0), 18.0)
        d = smooth_min(d, ellipsoid(x, y + 66.0, z - 54.0, 32.0, 27.0, 34.0), 16.0)
        if y < -60.0:
            d = smooth_min(d, ellipsoid(x, y + 101.0, z - 64.0, 19.0, 13.0, 18.0), 16.0)
    if y > -32.0 and y < 55.0:
        d = _eye_region(ax, y, z, brow, d)
    # Away from the nose a bound will do: it lies within |x| < 20, -55 < y < 20, z > 80.
    aside = max(ax - 20.0, y - 20.0, -55.0 - y, 80.0 - z)
    d = _nose(ax, y, z, longer, d) if aside < 25.0 else min(d, aside)
    if y < -45.0 and z > 60.0:
        d = _lips(ax, y, z, d)
        # Philtrum.
        if y > -70.0 and ax < 10.0:
            d += 0.8 * math.exp(-((ax / 3.0) ** 2) - ((y + 54.0) / 5.0) ** 2)
    return d


@compiled
def _teeth(x: float, y: float, z: float, centre: float, halfheight: float) -> float:
    """One row: a band on an ellipse, rounded."""
    rx, rz = 21.0, 21.0
    rim = abs(math.sqrt((x / rx) ** 2 + ((z - 64.0) / rz) ** 2) - 1.0) * rx - 1.6
    tall = abs(y - centre) - halfheight
    a, b = max(rim + 1.0, 0.0), max(tall + 1.0, 0.0)
    return math.sqrt(a * a + b * b) + min(max(rim, tall) + 1.0, 0.0) - 1.0


@compiled
def surface(x: float, y: float, z: float, pose: NDArray[np.float64]) -> tuple[float, int]:
    """Signed distance to all that is opaque, mm, and the material that is nearest."""
    xr, yr, zr = to_rest(x, y, z, pose)
    skin = skin_rest(xr, yr, zr, pose[BROW], pose[NOSE])
    d, material = skin, SKIN
    if z > 40.0 and skin < 25.0:
        ex = abs(x) - EYE_X
        if abs(y) < 20.0:
            slot = max(eye_slot(ex, y, pose[BLINK]), 58.0 - z)
            d = smooth_max(skin, -slot, 0.8)
            ball = math.sqrt(ex * ex + y * y + (z - EYE_Z) ** 2) - EYE_RADIUS
            if ball < d:
                d, material = ball, EYE
        elif pose[JAW] > 0.01 and y < -40.0:
            height, edge, half = mouth_gap(x, pose)
            slot = (abs(y - edge + 0.5 * height) - 0.5 * height) * 0.8
            slot = max(slot, 46.0 - z, abs(x) - half + 1.0)
            d = smooth_max(skin, -slot, 3.0 * clamp(height / 6.0, 0.05, 1.0))
            middle, _, _ = mouth_gap(0.0, pose)
            upper = _teeth(x, y, z, MOUTH_Y + 2.0, 7.5)
            lower = _teeth(x, y, z + 4.0 + 0.22 * middle, MOUTH_Y - middle - 2.5, 5.0)
            row = min(upper, lower)
            if row < d:
                d, material = row, TEETH
            tongue = ellipsoid(x, y - MOUTH_Y + 0.8 * middle + 5.0, z - 62.0, 15.0, 7.0, 18.0)
            if tongue < d:
                d, material = tongue, TONGUE
    if y < -120.0:
        cut = bust(x, y, z)
        if y < -145.0:
            # The neck ends inside of the clothes; the chin never comes down here.
            d = max(d, cut + CUT_MARGIN)
        cloth = shirt(x, y, z, cut)
        if cloth < d:
            d, material = cloth, SHIRT
    if pose[BALL] > 0.0:
        ball = math.sqrt((x - BALL_X) ** 2 + (y - BALL_Y) ** 2 + (z - BALL_Z) ** 2) - pose[BALL]
        if ball < d:
            d, material = ball, PROP
    return d, material


@compiled
def distance(x: float, y: float, z: float, pose: NDArray[np.float64]) -> float:
    d, _ = surface(x, y, z, pose)
    return d


@compiled
def normal(x: float, y: float, z: float, pose: NDArray[np.float64]) -> Vector:
    """Unit outward normal, from four distances on a tetrahedron."""
    e = 0.25
    a = distance(x + e, y - e, z - e, pose)
    b = distance(x - e, y - e, z + e, pose)
    c = distance(x - e, y + e, z - e, pose)
    d = distance(x + e, y + e, z + e, pose)
    nx, ny, nz = a - b - c + d, -a - b + c + d, -a + b - c + d
    length = max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
    return nx / length, ny / length, nz / length


@compiled
def reach(o: Vector, d: Vector, spread: float, pose: NDArray[np.float64]) -> float:
    """How far along all rays of a cone about (o, d), `spread` mm wider a mm, there surely is no surface; inf: all."""
    t, far = span(o, d, AROUND, RADIUS, spread)
    while t < far:
        clear = distance(o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2], pose) - spread * t
        if clear < 1.0:
            return t
        t += max(0.8 * clear, 1.0)
    return math.inf


@compiled
def trace(o: Vector, d: Vector, near: float, far: float, pose: NDArray[np.float64]) -> float:
    """Distance along the unit ray (o, d) to the first crossing of the surface, inf where there is none before `far`.

    Sphere tracing; close to the surface the last two distances tell how steeply the ray meets it, and the next step
    goes where the line through them is zero: half as many steps. From below the surface it steps back, once.
    """
    t, step, before, turned = near, 0.0, 0.0, False
    for _ in range(160):
        gap = distance(o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2], pose)
        if gap < 0.03 and (gap > -0.03 or turned):
            return t
        turned |= gap < 0.0
        slope = (before - gap) / step if step != 0.0 else 9.0
        step = gap * (0.97 if gap > 12.0 else 0.8) if gap > 3.0 or slope > 1.25 else gap / max(slope, 0.4)
        before = gap
        t += step
        if t > far:
            break
    return math.inf
