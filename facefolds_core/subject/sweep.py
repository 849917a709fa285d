"""Depths of pixels by plane sweep (Collins 1996): where neighbouring pictures show the same."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera

Array = NDArray[np.float32]

LONG_SIDE = 160
"""Pictures are compared at this size, pixels."""
BLUR = 0.7
"""Of these smaller pictures, standard deviation, pixels: noise and steps of a pixel are no texture."""
NEIGHBOURS = 6
"""Nearest cameras with which a picture is compared,"""
AGREEING = 3
"""of which so many must agree: others see something before it, or not at all."""
PLANES = (12, 64, 24)
"""Depths that are compared before, in and behind the subject's ball, even in inverse depth within each."""
REACH = (0.45, 10.0)
"""The nearest, in shares of the camera's distance from the origin, and the farthest, units."""
BEFORE_BALL = 0.9
"""The nearest depth in shares of the ball's nearest, where a camera stands so close that the first of `REACH` lies
within the ball: planes must go on from near to far."""
WINDOW = 5
"""Side of what is compared around a pixel, pixels."""
TRUNCATED = 0.2
"""Largest difference of colours that counts."""
STEPS = 1.5
"""Depths agree that differ by fewer planes."""


def depth_maps(
    cameras: Sequence[Camera], pictures: Sequence[Array], ball: float
) -> tuple[list[Camera], list[Array], list[Array], list[NDArray[np.int64]]]:
    """Of each picture (H, W, 3) float32: a smaller camera and picture, depth (h, w) along the optical axis, units, and
    how many of the neighbours find the same depth there."""
    small = [_reduced(*pair) for pair in zip(cameras, pictures, strict=True)]
    near = [_neighbours(cameras, index) for index in range(len(cameras))]
    planes = [_planes(camera, ball) for camera in cameras]
    depths = [_sweep(index, small, near[index], planes[index]) for index in range(len(cameras))]
    agree = [_agreeing(index, small, near[index], depths, planes) for index in range(len(cameras))]
    return [one for one, _ in small], [one for _, one in small], depths, agree


def _reduced(camera: Camera, picture: Array) -> tuple[Camera, Array]:
    scale = min(1.0, LONG_SIDE / max(camera.width, camera.height))
    camera = camera.resized(max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))
    small = cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return camera, np.asarray(cv2.GaussianBlur(small, (0, 0), BLUR), np.float32)


def _neighbours(cameras: Sequence[Camera], index: int) -> list[int]:
    """By the angle between their directions from the origin."""
    centres = np.array([camera.centre / np.linalg.norm(camera.centre) for camera in cameras])
    order = np.argsort(-(centres @ centres[index]), kind="stable")
    return [int(k) for k in order if k != index][:NEIGHBOURS]


def _planes(camera: Camera, ball: float) -> Array:
    """Depths, nearest first."""
    middle = float(camera.w2c[2, 3])  # of the origin
    near, far = max(middle - ball, 0.5 * middle), middle + ball
    edges = [REACH[0] * middle, near, far, max(REACH[1], 2 * far)]
    if edges[0] > near:
        edges[0] = BEFORE_BALL * near
    parts = [
        1 / a + (np.arange(count) + 0.5) / count * (1 / b - 1 / a)
        for a, b, count in zip(edges[:-1], edges[1:], PLANES, strict=True)
    ]
    return (1 / np.concatenate(parts)).astype(np.float32)


def _matrix(camera: Camera) -> NDArray[np.float64]:
    """K for pixel centres at whole numbers, which OpenCV's warps have."""
    K = camera.K.copy()
    K[:2, 2] -= 0.5
    return K


def _sweep(index: int, small: Sequence[tuple[Camera, Array]], near: Sequence[int], planes: Array) -> Array:
    """(h, w) depth."""
    camera, picture = small[index]
    size = camera.width, camera.height
    costs = np.empty((len(planes), camera.height, camera.width), np.float32)
    inverse = np.linalg.inv(_matrix(camera))
    moves = []
    for k in near:
        other = small[k][0]
        turn = other.rotation @ camera.rotation.T
        moves.append((turn, other.w2c[:, 3] - turn @ camera.w2c[:, 3], _matrix(other)))
    used = min(AGREEING, len(near))
    for number, depth in enumerate(planes):
        found = []
        for k, (turn, shift, matrix) in zip(near, moves, strict=True):
            plane = np.outer(shift, [0, 0, 1]) / float(depth)
            H = matrix @ (turn + plane) @ inverse
            warped = cv2.warpPerspective(
                small[k][1], H, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderValue=(9.0, 9.0, 9.0)
            )
            difference = np.abs(warped - picture).sum(-1) * np.float32(1 / 3)
            found.append(cv2.blur(np.minimum(difference, TRUNCATED), (WINDOW, WINDOW)))
        costs[number] = np.sort(np.stack(found), 0)[:used].mean(0)
    return np.asarray(planes[np.argmin(costs, 0)])


def _agreeing(
    index: int,
    small: Sequence[tuple[Camera, Array]],
    near: Sequence[int],
    depths: Sequence[Array],
    planes: Sequence[Array],
) -> NDArray[np.int64]:
    """(h, w) how many neighbours find what this picture finds."""
    camera = small[index][0]
    points = places(camera, depths[index])
    agree = np.zeros(depths[index].shape, np.int64)
    for k in near:
        other = small[k][0]
        pixels, depth = other.project(points)
        inside = (pixels >= 0).all(-1) & (pixels[..., 0] < other.width) & (pixels[..., 1] < other.height) & (depth > 0)
        x, y = (np.where(inside, pixels[..., axis], 0).astype(np.int64) for axis in (0, 1))
        rank = np.searchsorted(planes[k], np.stack([depth, depths[k][y, x]]))
        agree += inside & (np.abs(rank[0] - rank[1]) <= STEPS)
    return agree


def places(camera: Camera, depth: Array) -> NDArray[np.float64]:
    """(H, W, 3) where pixels are in the world whose depths along the optical axis are known."""
    origins, directions = camera.rays()
    return np.asarray(origins + directions * (depth / (directions @ camera.forward))[..., None])
