"""Quadric error (Garland and Heckbert 1997, 1998) in five dimensions: a layer's position relative to c, and its texture
coordinates in units of length. Compiled."""

from __future__ import annotations

import math

import numpy as np

from facefolds_core.kernels.jit import inlined, kernel

TERMS = 21
"""Of a quadric in five dimensions: 15 of the symmetric matrix, 5 linear, 1 constant."""


@kernel
def _add_face(quadric, p, q, r, weight):  # type: ignore[no-untyped-def]
    """Add weight times the squared distance from the plane through p, q, r (5,) to a quadric (21,)."""
    first = np.empty(5)
    second = np.empty(5)
    length = 0.0
    for i in range(5):
        first[i] = q[i] - p[i]
        length += first[i] * first[i]
    length = math.sqrt(length)
    along = 0.0
    for i in range(5):
        first[i] /= length
        second[i] = r[i] - p[i]
        along += first[i] * second[i]
    height = 0.0
    for i in range(5):
        second[i] -= along * first[i]
        height += second[i] * second[i]
    height = math.sqrt(height)
    if not (length > 0.0 and height > 0.0):
        return
    weight *= 0.5 * length * height
    p1, p2, pp = 0.0, 0.0, 0.0
    for i in range(5):
        second[i] /= height
        p1 += p[i] * first[i]
        p2 += p[i] * second[i]
        pp += p[i] * p[i]
    k = 0
    for i in range(5):
        for j in range(i, 5):
            quadric[k] += weight * ((1.0 if i == j else 0.0) - first[i] * first[j] - second[i] * second[j])
            k += 1
    for i in range(5):
        quadric[15 + i] += weight * (p1 * first[i] + p2 * second[i] - p[i])
    quadric[20] += weight * (pp - p1 * p1 - p2 * p2)


@kernel
def build_quadrics(points, faces, weights):  # type: ignore[no-untyped-def]
    """points (V, L, 5), faces (F, 3), weights (F, L) -> (V, L, 21): sums over each vertex's faces, times their area."""
    quadrics = np.zeros((points.shape[0], points.shape[1], TERMS))
    own = np.empty(TERMS)
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        for n in range(points.shape[1]):
            own[:] = 0.0
            _add_face(own, points[i, n], points[j, n], points[k, n], weights[f, n])
            for t in range(TERMS):
                quadrics[i, n, t] += own[t]
                quadrics[j, n, t] += own[t]
                quadrics[k, n, t] += own[t]
    return quadrics


@inlined
def cost(a, b, x):  # type: ignore[no-untyped-def]
    """The sum of two quadrics (21,) at x (5,)."""
    x0, x1, x2, x3, x4 = x[0], x[1], x[2], x[3], x[4]
    value = a[20] + b[20]
    value += 2 * ((a[15] + b[15]) * x0 + (a[16] + b[16]) * x1 + (a[17] + b[17]) * x2)
    value += 2 * ((a[18] + b[18]) * x3 + (a[19] + b[19]) * x4)
    value += (a[0] + b[0]) * x0 * x0 + (a[5] + b[5]) * x1 * x1 + (a[9] + b[9]) * x2 * x2
    value += (a[12] + b[12]) * x3 * x3 + (a[14] + b[14]) * x4 * x4
    value += 2 * x0 * ((a[1] + b[1]) * x1 + (a[2] + b[2]) * x2 + (a[3] + b[3]) * x3 + (a[4] + b[4]) * x4)
    value += 2 * x1 * ((a[6] + b[6]) * x2 + (a[7] + b[7]) * x3 + (a[8] + b[8]) * x4)
    value += 2 * x2 * ((a[10] + b[10]) * x3 + (a[11] + b[11]) * x4) + 2 * x3 * (a[13] + b[13]) * x4
    return value
