"""Pinhole cameras, in the one convention of this project (docs/reference/conventions.md).

- Camera axes are OpenCV's: x right, y down, z forward. `w2c` maps world to camera: X_c = R X_w + t.
- Image coordinates are continuous: pixel (column i, row j) covers [i, i+1) x [j, j+1), its centre is
  (i + 0.5, j + 0.5). Sources that put pixel centres at whole numbers are shifted when they are read.
- Geometry is float64 numpy up to the training loop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.geometry.similarity import Similarity

Array = NDArray[np.float64]

HUGE = 1e9
"""No number of a calibration is larger: a million kilometres in millimetres."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion.

    Attributes:
        name: its name in the capture.
        K: (3, 3) intrinsics in pixels, last row (0, 0, 1).
        w2c: (3, 4) world -> camera, [R | t], R a rotation.
        width, height: image size in pixels.
    """

    name: str
    K: Array
    w2c: Array
    width: int
    height: int

    @property
    def rotation(self) -> Array:
        """(3, 3) R of `w2c`."""
        return self.w2c[:, :3]

    @property
    def centre(self) -> Array:
        """(3,) camera centre in the world."""
        return -self.rotation.T @ self.w2c[:, 3]

    @property
    def forward(self) -> Array:
        """(3,) unit viewing direction in the world."""
        return np.asarray(self.rotation[2])

    def project(self, points: Array) -> tuple[Array, Array]:
        """World points (..., 3) -> pixels (..., 2) as (x, y), and depth along the optical axis (...)."""
        in_camera = points @ self.rotation.T + self.w2c[:, 3]
        image = in_camera @ self.K.T
        depth = in_camera[..., 2]
        return image[..., :2] / image[..., 2:], depth

    def rays(self, pixels: Array | None = None) -> tuple[Array, Array]:
        """Rays through pixels.

        Args:
            pixels: (..., 2) continuous image coordinates (x, y); by default the centres of all pixels,
                (height, width, 2).

        Returns:
            origins (..., 3) and unit directions (..., 3), in the world.
        """
        if pixels is None:
            pixels = self.pixel_centres()
        homogeneous = np.concatenate([pixels, np.ones_like(pixels[..., :1])], -1)
        directions = homogeneous @ np.linalg.inv(self.K).T @ self.rotation
        directions = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
        return np.broadcast_to(self.centre, directions.shape), directions

    def pixel_centres(self) -> Array:
        """(height, width, 2) continuous coordinates (x, y) of the pixel centres."""
        x, y = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        return np.stack([x, y], -1)

    def resized(self, width: int, height: int) -> Camera:
        """The same camera for an image resampled to `width` x `height`."""
        scale = np.diag([width / self.width, height / self.height, 1.0])
        return replace(self, K=scale @ self.K, width=width, height=height)

    def transformed(self, similarity: Similarity) -> Camera:
        """The same camera after the world was moved by `similarity` (new = s R x + t); depths scale by s."""
        rotation = self.rotation @ similarity.rotation.T
        translation = similarity.scale * self.w2c[:, 3] - rotation @ similarity.translation
        return replace(self, w2c=np.concatenate([rotation, translation[:, None]], 1))


def is_rotation(R: Array, tolerance: float = 1e-3) -> bool:
    """Whether R (3, 3) is orthonormal and no reflection."""
    return bool(np.abs(R @ R.T - np.eye(3)).max() <= tolerance and np.linalg.det(R) > 0)


def check_camera(camera: Camera, file: object, place: str) -> None:
    """Refuse a camera that cannot project.

    Raises:
        UserError: if K is singular or not finite, or R is not a rotation (tolerance 1e-3), naming `file` and `place`.
    """
    remedy = "mend the calibration of this camera, or take the camera out of the capture"
    wrong = partial(UserError, file=str(file), place=place, remedy=remedy)
    numbers = np.concatenate([camera.K.ravel(), camera.w2c.ravel()])
    if not (np.abs(numbers) <= HUGE).all():
        finite = bool(np.isfinite(numbers).all())
        raise wrong(
            f"the camera has numbers that are {'beyond sense' if finite else 'not finite'}",
            expected=f"finite K and [R|t], no number above {HUGE:g}",
            found=f"{float(np.abs(numbers).max()):g}",
        )
    K = camera.K
    fx, fy = K[0, 0], K[1, 1]
    slanted = abs(K[1, 0]) > 1e-6 * fy or abs(K[0, 1]) > fx
    if min(fx, fy) <= 1e-3 or max(fx, fy) > 10 * min(fx, fy) or slanted or not np.allclose(K[2], [0, 0, 1]):
        raise wrong(
            "the intrinsic matrix K is singular or not a pinhole camera's",
            expected="fx 0 cx, 0 fy cy, 0 0 1: positive focal lengths, less than tenfold different",
            found=K.tolist(),
        )
    R = camera.rotation
    if not is_rotation(R):
        raise wrong(
            "R of [R|t] is not a rotation",
            expected="R R^T = I and det R = 1",
            found=f"det R = {np.linalg.det(R):.6g}, R = {R.tolist()}",
        )
