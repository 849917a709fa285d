"""One frame laid over another: points of a surface with what cameras saw there, and Gauss-Newton on their pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import turn_of

Array = NDArray[np.float64]
Features = NDArray[np.float32]

STEPS = 12
"""Gauss-Newton steps a scale, at most."""

ENOUGH = 2e-5
"""A scale ends with a smaller step than this, radians and units."""

DAMPING = 0.001
"""Added to the normal equations, as a share of their diagonal."""

OUTLIER = 2.0
"""Residual, in medians, at which a point counts half."""

MIN_COSINE = 0.3
"""Least cosine between a point's normal and the direction to the camera."""

MIN_POINTS = 200
"""A frame with fewer points gets no pose."""


@dataclass(frozen=True)
class Points:
    """What one camera saw of the subject's surface in the reference frame.

    Attributes:
        positions, normals: (P, 3), in the world.
        pixels: (P, 2) x, y.
        weight: (P,) how much each counts.
    """

    positions: Array
    normals: Array
    pixels: Array
    weight: Array


def features(image: NDArray[np.uint8], sigma: float) -> Features:
    """(H, W, 3): a picture's grey levels at a scale, locally normalised, and their slopes along x and y."""
    grey = cv2.GaussianBlur(image.astype(np.float32).mean(-1), (0, 0), sigma)
    mean = cv2.GaussianBlur(grey, (0, 0), 4 * sigma)
    contrast = np.sqrt(cv2.GaussianBlur((grey - mean) ** 2, (0, 0), 4 * sigma) + 1.0)
    value = (grey - mean) / contrast
    slopes = np.gradient(value)
    return np.stack([value, slopes[1], slopes[0]], -1).astype(np.float32)


def look_up(picture: Features, pixels: Array) -> Array:
    """(P, C) at continuous coordinates (P, 2), bilinear."""
    at = (pixels - 0.5).astype(np.float32)[None]
    found = cv2.remap(picture, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found[0], np.float64)


def refined(
    pose: Similarity,
    cameras: Sequence[Camera],
    points: Sequence[Points],
    shown: Sequence[Features],
    seen: Sequence[Array],
) -> tuple[Similarity, float]:
    """Gauss-Newton steps at one scale; the pose and the correlation there.

    Args:
        shown: of each camera, `features` of the frame.
        seen: of each camera (P,), features of its points in the reference frame.
    """
    likeness = 0.0
    for _ in range(STEPS):
        equations = Equations.of(pose, cameras, points, shown, seen)
        if len(equations.residual) < MIN_POINTS:
            return pose, 0.0
        pull = equations.slopes.T @ (equations.weight * equations.residual)
        move: Array = -np.linalg.solve(equations.normal(), pull).astype(np.float64)
        turned = Similarity(1.0, turn_of(move[:3]), np.zeros(3))
        shift = equations.middle + move[3:] - turned.apply(equations.middle)
        pose = Similarity(1.0, turned.rotation, shift).after(pose)
        likeness = equations.likeness()
        if np.abs(move).max() < ENOUGH:
            break
    return pose, likeness


@dataclass(frozen=True)
class Equations:
    """One frame's, linearised at a pose; P points of all cameras.

    Attributes:
        middle: (3,) that turns are about.
        slopes: (P, 6) of the residuals in turn and shift; depth: (P,) in a move of the points along their rays.
        residual, value: (P,) difference from the reference, and what the frame shows.
        own, weight: (P,) the points' own, and times Cauchy's.
    """

    middle: Array
    slopes: Array
    depth: Array
    residual: Array
    value: Array
    own: Array
    weight: Array

    @classmethod
    def of(
        cls,
        pose: Similarity,
        cameras: Sequence[Camera],
        points: Sequence[Points],
        shown: Sequence[Features],
        seen: Sequence[Array],
    ) -> Equations:
        middle = pose.apply(np.concatenate([one.positions for one in points]).mean(0))
        rows = [_rows(pose, middle, *one) for one in zip(cameras, points, shown, seen, strict=True)]
        slopes, depth, residual, value, own = (np.concatenate(parts) for parts in zip(*rows, strict=True))
        off = np.abs(residual)
        typical = float(np.quantile(off, 0.5, weights=own, method="inverted_cdf")) if len(off) else 0.0
        weight = own / (1 + (residual / (OUTLIER * typical + 1e-9)) ** 2)
        return cls(middle, slopes, depth, residual, value, own, weight)

    def normal(self) -> Array:
        """(6, 6)."""
        normal = self.slopes.T @ (self.weight[:, None] * self.slopes)
        return np.asarray(normal + np.diag(DAMPING * np.diag(normal) + 1e-9))

    def likeness(self) -> float:
        """Correlation of what the frame shows with what the reference showed."""
        both = np.cov(self.value, self.value - self.residual, aweights=self.own)
        return float(both[0, 1] / np.sqrt(both[0, 0] * both[1, 1]))

    def along_rays(self) -> tuple[float, float]:
        """Curvature and slope of the squared error in a move along the rays, with the pose following (Schur)."""
        weighted = self.weight * self.depth
        cross = self.slopes.T @ weighted
        follows = np.linalg.solve(self.normal(), cross)
        pull = self.slopes.T @ (self.weight * self.residual)
        return float(weighted @ self.depth - cross @ follows), float(weighted @ self.residual - follows @ pull)


def _rows(
    pose: Similarity,
    middle: Array,
    camera: Camera,
    points: Points,
    shown: Features,
    seen: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Slopes (P, 6), depth, residual, value and weight (P,) of the points that this camera sees."""
    use, pixels, there = _visible(pose, camera, points)
    depth = camera.project(there)[1]
    values = look_up(shown, pixels)
    fx, fy = camera.K[0, 0], camera.K[1, 1]
    centred = (pixels - camera.K[:2, 2]) / [fx, fy]
    # d value / d point in the camera's axes, then in the world's.
    gx, gy = values[:, 1] * fx / depth, values[:, 2] * fy / depth
    slope = np.stack([gx, gy, -(gx * centred[:, 0] + gy * centred[:, 1])], -1) @ camera.rotation
    along = unit(points.positions[use] - camera.centre) @ pose.rotation.T
    slopes = np.concatenate([np.cross(there - middle, slope), slope], 1)
    return slopes, (slope * along).sum(1), values[:, 0] - seen[use], values[:, 0], points.weight[use]


def unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def _visible(pose: Similarity, camera: Camera, points: Points) -> tuple[NDArray[np.intp], Array, Array]:
    """Which of the moved points a camera sees; their pixels (P, 2) and places (P, 3)."""
    there = pose.apply(points.positions)
    normals = points.normals @ pose.rotation.T
    towards = camera.centre - there
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    pixels, depth = camera.project(there)
    inside = ((pixels >= 1) & (pixels <= [camera.width - 1, camera.height - 1])).all(1) & (depth > 0)
    use = np.flatnonzero(inside & ((normals * towards).sum(1) > MIN_COSINE))
    return use, pixels[use], there[use]
