"""`Chart.uv` of one point, compiled, for kernels."""

from __future__ import annotations

import math

from facefolds_core.kernels.jit import inlined

_TO_UV = 2.0 / math.pi


@inlined
def chart_position(x, y, z, belt):  # type: ignore[no-untyped-def]
    """(u, v, radius) of a point minus c: `geometry.chart`, whose `numbers` are `belt`."""
    flat = math.sqrt(x * x + y * y)
    v = _TO_UV * math.atan2(y, x)
    slide = -z - flat * belt[1]
    if slide > 0.0:
        u = -_TO_UV * (belt[0] + slide * belt[3])
        r = flat * belt[2]
    else:
        r = math.sqrt(x * x + y * y + z * z)
        u = _TO_UV * math.asin(min(1.0, max(-1.0, z / r)))
    return u, v, r


@inlined
def chart_radius(x, y, z, belt):  # type: ignore[no-untyped-def]
    """The radius of `chart_position` alone."""
    flat = math.sqrt(x * x + y * y)
    return flat * belt[2] if -z - flat * belt[1] > 0.0 else math.sqrt(x * x + y * y + z * z)
