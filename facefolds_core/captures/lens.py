"""Lens distortion, and photos freed from it: OpenCV's radial-tangential model, and its fisheye model.

- Radial-tangential: k1, k2, p1, p2, k3, and where there are eight, k4, k5, k6 of the rational model.
- Fisheye (Kannala and Brandt 2006; `cv2.fisheye`): k1 to k4; a point at the angle theta from the axis lies at
  theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8). An ideal fisheye has four zeros.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Lens:
    """The intrinsics of a photo with distortion, and of the pinhole image made from it.

    Attributes:
        K: (3, 3) of the photo; continuous pixel coordinates, as everywhere.
        coefficients: (5,) k1, k2, p1, p2, k3, or (8,) with k4, k5, k6; of a fisheye (4,) k1 to k4.
        pinhole: (3, 3) of the undistorted image, which has the same size.
        fisheye: the model of the coefficients.
    """

    K: Array
    coefficients: Array
    pinhole: Array
    fisheye: bool = False

    def distort(self, points: Array) -> Array:
        """Ideal image-plane points (..., 2), X_c / Z_c, -> where the lens puts them, pixels (..., 2) of the photo."""
        if self.fisheye:
            r = np.linalg.norm(points, axis=-1)
            scale = np.where(r > 0, self._angle(np.arctan(r)) / np.where(r > 0, r, 1.0), 1.0)
            bent = np.concatenate([points * scale[..., None], np.ones_like(r)[..., None]], -1)
            return np.asarray((bent @ self.K.T)[..., :2])
        k1, k2, p1, p2, k3 = self.coefficients[:5]
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        if len(self.coefficients) == 8:
            k4, k5, k6 = self.coefficients[5:]
            radial = radial / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        moved = np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
                np.ones_like(x),
            ],
            -1,
        )
        return (moved @ self.K.T)[..., :2]

    def _angle(self, theta: Array) -> Array:
        """Where a fisheye puts angles from the axis (...), radians."""
        k1, k2, k3, k4 = self.coefficients
        t2 = theta * theta
        return np.asarray(theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))))

    def folds(self, pixels: Array) -> bool:
        """Whether a fisheye's polynomial turns back on the way to pixels (..., 2) of the undistorted image."""
        if not self.fisheye:
            return False
        radius = np.linalg.norm(self._ideal(pixels), axis=-1).max()
        angles = self._angle(np.linspace(0, np.arctan(radius), 256))
        return bool((np.diff(angles) <= 0).any())

    def source_of(self, pixels: Array) -> Array:
        """Pixels (..., 2) of the undistorted image -> pixels (..., 2) of the photo."""
        return self.distort(self._ideal(pixels))

    def _ideal(self, pixels: Array) -> Array:
        """Pixels (..., 2) of the undistorted image -> points (..., 2) of the image plane, X_c / Z_c."""
        homogeneous = np.concatenate([pixels, np.ones_like(pixels[..., :1])], -1)
        return np.asarray((homogeneous @ np.linalg.inv(self.pinhole).T)[..., :2])

    def maps(self, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Where each pixel of the undistorted image samples the photo: x and y (height, width), for `cv2.remap`."""
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        # cv2.remap counts from the centre of the first pixel; our coordinates count from its corner.
        source = self.source_of(np.stack([x, y], -1)) - 0.5
        return source[..., 0].astype(np.float32), source[..., 1].astype(np.float32)


def undistort(image: NDArray[np.uint8], maps: tuple[NDArray[np.float32], NDArray[np.float32]]) -> NDArray[np.uint8]:
    """(H, W, C) photo -> (H, W, C) pinhole image, sampled bicubically at `Lens.maps`."""
    straight = cv2.remap(image, *maps, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(straight, np.uint8).reshape(image.shape)


def make_lens(
    K: Array, coefficients: Array, width: int, height: int, file: object, place: str, fisheye: bool = False
) -> Lens | None:
    """The lens of one camera, or None where it does not distort.

    The undistorted image keeps K, unless it would then show places outside the photo (pincushion distortion): its focal
    lengths are enlarged until it does not, so that no pixel is made up.

    Args:
        K: (3, 3) of the photo.
        coefficients, fisheye: as of `Lens`.
        file, place: for the message.
    """
    if not fisheye and not np.any(coefficients):
        return None

    def zoomed(factor: float) -> Lens:
        """With focal lengths times `factor`; the principal point stays."""
        return Lens(K, coefficients, np.concatenate([np.diag([factor, factor, 1.0]) @ K[:, :2], K[:, 2:]], 1), fisheye)

    def inside(lens: Lens) -> bool:
        points = lens.source_of(border)
        within = (points >= 0.5).all() and (points <= [width - 0.5, height - 0.5]).all()
        return bool(within) and not lens.folds(border)

    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    rows = [np.stack([x, np.full_like(x, v)], -1) for v in (0.5, height - 0.5)]
    columns = [np.stack([np.full_like(y, v), y], -1) for v in (0.5, width - 0.5)]
    border = np.concatenate(rows + columns)
    if inside(zoomed(1.0)):
        return zoomed(1.0)
    low, high = 1.0, 2.0
    if not inside(zoomed(high)):
        raise UserError(
            "the distortion is too strong to undo",
            file=str(file),
            place=place,
            expected="k1, k2, k3, k4 of a fisheye lens" if fisheye else "k1, k2, p1, p2, k3 of a lens",
            found=coefficients.tolist(),
            remedy="check the distortion values, and whether the lens is a fisheye",
        )
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (low, middle) if inside(zoomed(middle)) else (middle, high)
    return zoomed(high)
