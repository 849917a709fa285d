"""Scalar building blocks in head millimetres: interpolation, distances, rays, value noise. All compiled."""

from __future__ import annotations

import math

from facefolds_core.kernels.jit import compiled

Vector = tuple[float, float, float]


@compiled
def clamp(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


@compiled
def smoothstep(edge0: float, edge1: float, x: float) -> float:
    """0 at `edge0`, 1 at `edge1` (which may be the smaller), cubic between."""
    t = min(max((x - edge0) / (edge1 - edge0), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@compiled
def mix(a: Vector, b: Vector, t: float) -> Vector:
    """a + t (b - a), for colours."""
    return (a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t)


@compiled
def smooth_min(a: float, b: float, k: float) -> float:
    """Polynomial smooth minimum (Quilez): differs from min(a, b) where |a - b| < k, by k / 4 at most."""
    h = max(k - abs(a - b), 0.0)
    return min(a, b) - h * h * (0.25 / k)


@compiled
def smooth_max(a: float, b: float, k: float) -> float:
    return -smooth_min(-a, -b, k)


@compiled
def ellipsoid(x: float, y: float, z: float, rx: float, ry: float, rz: float) -> float:
    """Approximate signed distance to an ellipsoid at the origin (Quilez): exact to first order at the surface."""
    # Radii are constants where this is called: their reciprocals are, too, once it is built in there.
    ix, iy, iz = 1.0 / rx, 1.0 / ry, 1.0 / rz
    x, y, z = x * ix, y * iy, z * iz
    square = x * x + y * y + z * z
    x, y, z = x * ix, y * iy, z * iz
    slope = math.sqrt(x * x + y * y + z * z)
    if slope < 1e-9:
        return -min(rx, ry, rz)
    return (square - math.sqrt(square)) / slope


@compiled
def cone(x: float, y: float, z: float, ay: float, az: float, by: float, bz: float, ra: float, rb: float) -> float:
    """Approximate distance to a round cone in the plane x = 0, from (ay, az) with radius ra to (by, bz) with rb."""
    dy, dz = by - ay, bz - az
    t = min(max(((y - ay) * dy + (z - az) * dz) / (dy * dy + dz * dz), 0.0), 1.0)
    return math.sqrt(x * x + (y - ay - t * dy) ** 2 + (z - az - t * dz) ** 2) - (ra + (rb - ra) * t)


@compiled
def hash3(i: int, j: int, k: int, seed: int) -> float:
    """A number in [0, 1) from a lattice point: integer mixing in 32 bits."""
    n = (i * 374761393 + j * 668265263 + k * 2147483647 + seed * 1274126177) & 0xFFFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0xFFFFFFFF
    n = ((n ^ (n >> 15)) * 2246822519) & 0xFFFFFFFF
    return float((n ^ (n >> 16)) & 0xFFFFFF) / 16777216.0


@compiled
def value_noise(x: float, y: float, z: float, seed: int) -> float:
    """Value noise in [0, 1], one cell a unit, trilinear over a smoothed lattice."""
    fx, fy, fz = math.floor(x), math.floor(y), math.floor(z)
    i, j, k = int(fx), int(fy), int(fz)
    u, v, w = x - fx, y - fy, z - fz
    u, v, w = u * u * (3 - 2 * u), v * v * (3 - 2 * v), w * w * (3 - 2 * w)
    a = hash3(i, j, k, seed) * (1 - u) + hash3(i + 1, j, k, seed) * u
    b = hash3(i, j + 1, k, seed) * (1 - u) + hash3(i + 1, j + 1, k, seed) * u
    c = hash3(i, j, k + 1, seed) * (1 - u) + hash3(i + 1, j, k + 1, seed) * u
    d = hash3(i, j + 1, k + 1, seed) * (1 - u) + hash3(i + 1, j + 1, k + 1, seed) * u
    return (a * (1 - v) + b * v) * (1 - w) + (c * (1 - v) + d * v) * w


@compiled
def span(o: Vector, d: Vector, centre: Vector, radius: float, spread: float) -> tuple[float, float]:
    """Distances at which the cone about the ray (o, d), `spread` mm wider a mm, enters a sphere and has left it.

    They are the same where it passes by; neither is negative.
    """
    x, y, z = o[0] - centre[0], o[1] - centre[1], o[2] - centre[2]
    b = x * d[0] + y * d[1] + z * d[2]
    radius += spread * (max(-b, 0.0) + radius)
    root = b * b - (x * x + y * y + z * z - radius * radius)
    half = math.sqrt(root) if root > 0.0 else 0.0
    return max(-b - half, 0.0), max(-b + half, 0.0)
