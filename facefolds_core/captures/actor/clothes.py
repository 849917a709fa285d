"""A pullover with a collar, cut like a sculpture's bust: all of it is in every picture, so that nothing ends torn."""

from __future__ import annotations

import math

from facefolds_core.captures.actor.noise import (
    Vector,
    clamp,
    ellipsoid,
    mix,
    smooth_max,
    smooth_min,
    smoothstep,
    value_noise,
)
from facefolds_core.kernels.jit import compiled

CUT_MARGIN = 6.0
"""mm by which what is under the clothes ends above their lower edge."""
_COLLAR_Y, _COLLAR_Z, _COLLAR_RADIUS = -150.0, -36.0, 55.0
_COLLAR_TILT = 0.24
"""The collar is lower in front, mm a mm."""
_HEM = 9.0
"""Width of the seam along the lower edge, mm."""


@compiled
def bust(x: float, y: float, z: float) -> float:
    """Signed distance to the block that the bust is cut from, mm: an upright oval with a bottom that rises sideways."""
    k = math.sqrt((x / 104.0) ** 2 + ((z + 27.0) / 74.0) ** 2)
    sides = (k - 1.0) * 74.0
    bottom = 0.95 * (-199.0 + 0.0022 * x * x + 0.0015 * (z + 27.0) ** 2 - y)
    return smooth_max(sides, bottom, 24.0)


@compiled
def shirt(x: float, y: float, z: float, cut: float) -> float:
    """Signed distance to the shoulders with a round collar, mm; `cut` is `bust` there."""
    ax = abs(x)
    d = ellipsoid(ax - 60.0, y + 240.0, z + 36.0, 130.0, 82.0, 76.0)
    d = smooth_min(d, ellipsoid(x, y + 276.0, z + 27.0, 130.0, 128.0, 93.0), 25.0)
    d = smooth_max(d, cut, 8.0)
    tilt = y - _COLLAR_Y + _COLLAR_TILT * (z - _COLLAR_Z)
    # A rounded disc that the neck pierces, so that nothing shows between them.
    beyond = max(math.sqrt(x * x + (z - _COLLAR_Z) ** 2) - _COLLAR_RADIUS, 0.0)
    return smooth_min(d, math.sqrt(beyond * beyond + tilt * tilt) - 7.5, 14.0)


@compiled
def shirt_paint(x: float, y: float, z: float) -> Vector:
    """Knit; ribs around the collar, a darker seam along the lower edge."""
    knit = 0.92 + 0.16 * value_noise(x / 2.5, y / 6.0, z / 2.5, 51)
    cut = bust(x, y, z)
    angle = math.atan2(x, z - _COLLAR_Z)
    collar = smoothstep(16.0, 8.0, abs(y - _COLLAR_Y + _COLLAR_TILT * (z - _COLLAR_Z)))
    collar *= smoothstep(_COLLAR_RADIUS + 22.0, _COLLAR_RADIUS + 10.0, math.sqrt(x * x + (z - _COLLAR_Z) ** 2))
    rib = 0.5 + 0.5 * math.sin(90.0 * angle)
    light = knit * (1.0 - 0.22 * collar * rib)
    seam = smoothstep(-_HEM, -_HEM + 1.5, cut)
    colour = mix((0.16, 0.27, 0.42), (0.10, 0.17, 0.28), seam)
    return clamp(colour[0] * light, 0.0, 1.0), clamp(colour[1] * light, 0.0, 1.0), clamp(colour[2] * light, 0.0, 1.0)
