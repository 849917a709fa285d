"""The same hits as `reference.AssetCaster`, ten times faster: every triangle is drawn into a depth buffer, compiled.

A pixel's ray is t d with d = K^-1 (x, y, 1) in camera axes. With the triangle's vertices as the columns of M, the ray
meets its plane where t d = M b, sum b = 1. So e = M^-1 d, which is affine in (x, y), has b = t e and 1/t = sum e: the
ray hits if all e >= 0, nearest where sum e is largest. Nothing needs clipping at the camera's plane (Olano and Greer
1997).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.kernels.jit import kernel
from facefolds_core.rendering.reference import Hits

EDGE = 1e-9
"""A ray that passes an edge by less than this share of the triangle hits: none slips between two triangles."""

FLAT = 1e-12
"""Triangles seen from the side (|det M| below this times the product of the columns' lengths) are not drawn."""


def cast_mesh(camera: Camera, mesh: TexturedMesh) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Nearest hits of the rays through all pixel centres with one mesh: hit (H, W), and st (H, W, 2), 0 without one."""
    hit = np.zeros((camera.height, camera.width), bool)
    st = np.zeros((*hit.shape, 2), np.float32)
    corners = mesh.vertices.astype(np.float64) @ camera.rotation.T + camera.w2c[:, 3]
    image = corners @ camera.K.T
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = image[:, :2] / image[:, 2:]
    _draw(corners, pixels, mesh.faces, mesh.st, np.linalg.inv(camera.K), hit, st)
    return hit, st


def cast_layers(camera: Camera, layers: Any) -> Hits:
    """Hits with all layers, as `AssetCaster.cast` finds them.

    Args:
        layers: sequence of N meshes, outermost first.
    """
    shape = (camera.height, camera.width)
    hit = np.zeros((*shape, len(layers)), bool)
    st = np.zeros((*shape, len(layers), 2), np.float32)
    for i, layer in enumerate(layers):
        hit[..., i], st[..., i, :] = cast_mesh(camera, layer)
    return Hits(hit, st)


@kernel(nogil=True)
def _draw(  # type: ignore[no-untyped-def]
    corners,  # (V, 3) float64, camera axes
    pixels,  # (V, 2) float64, their projections
    faces,  # (F, 3)
    texture,  # (V, 2) float32
    inverse,  # (3, 3) K^-1
    hit,  # (H, W) bool
    st,  # (H, W, 2) float32
):
    height, width = hit.shape
    nearest = np.zeros((height, width))  # sum e = 1 / t
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x0, x1, y0, y1 = 0, width, 0, height
        if corners[i, 2] > 0 and corners[j, 2] > 0 and corners[k, 2] > 0:
            left = min(pixels[i, 0], pixels[j, 0], pixels[k, 0])
            right = max(pixels[i, 0], pixels[j, 0], pixels[k, 0])
            top = min(pixels[i, 1], pixels[j, 1], pixels[k, 1])
            bottom = max(pixels[i, 1], pixels[j, 1], pixels[k, 1])
            if right < 0 or left > width or bottom < 0 or top > height:
                continue
            x0, x1 = math.ceil(max(left - 0.5 - 1e-6, 0.0)), math.floor(min(right - 0.5 + 1e-6, width - 1.0)) + 1
            y0, y1 = math.ceil(max(top - 0.5 - 1e-6, 0.0)), math.floor(min(bottom - 0.5 + 1e-6, height - 1.0)) + 1
            if x0 >= x1 or y0 >= y1:
                continue
        elif corners[i, 2] <= 0 and corners[j, 2] <= 0 and corners[k, 2] <= 0:
            continue
        a0, a1, a2 = corners[i, 0], corners[i, 1], corners[i, 2]
        b0, b1, b2 = corners[j, 0], corners[j, 1], corners[j, 2]
        c0, c1, c2 = corners[k, 0], corners[k, 1], corners[k, 2]
        p0, p1, p2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
        q0, q1, q2 = c1 * a2 - c2 * a1, c2 * a0 - c0 * a2, c0 * a1 - c1 * a0
        r0, r1, r2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        det = a0 * p0 + a1 * p1 + a2 * p2
        size = (a0 * a0 + a1 * a1 + a2 * a2) * (b0 * b0 + b1 * b1 + b2 * b2) * (c0 * c0 + c1 * c1 + c2 * c2)
        if abs(det) <= FLAT * math.sqrt(size):
            continue
        scale = 1.0 / det
        # e at pixel (x, y): rows of M^-1 times K^-1 (x, y, 1); affine in x and y.
        for y in range(y0, y1):
            for x in range(x0, x1):
                u, v = x + 0.5, y + 0.5
                d0 = inverse[0, 0] * u + inverse[0, 1] * v + inverse[0, 2]
                d1 = inverse[1, 1] * v + inverse[1, 2]
                ei = (p0 * d0 + p1 * d1 + p2) * scale
                ej = (q0 * d0 + q1 * d1 + q2) * scale
                ek = (r0 * d0 + r1 * d1 + r2) * scale
                total = ei + ej + ek
                slack = -EDGE * abs(total)
                if total > nearest[y, x] and ei >= slack and ej >= slack and ek >= slack:
                    nearest[y, x] = total
                    near = 1.0 / total
                    hit[y, x] = True
                    st[y, x, 0] = (ei * texture[i, 0] + ej * texture[j, 0] + ek * texture[k, 0]) * near
                    st[y, x, 1] = (ei * texture[i, 1] + ej * texture[j, 1] + ek * texture[k, 1]) * near
