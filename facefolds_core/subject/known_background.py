"""Opacity before a known background: Bayesian matting (Chuang et al. 2001) where B is the clean plate.

A pixel shows I = a F + (1 - a) B. Of the subject's colour F only this is known: nearby it has such a mean and such a
covariance, so I is normal with mean a m + (1 - a) B and covariance a^2 S + n^2, n the pictures' noise. Pixels are asked
ring by ring, from the subject's inside outwards; each ring's colours tell the next.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float32]
Mask = NDArray[np.bool_]


NOISE = 0.01
"""Least standard deviation of noise that is reckoned with."""
SPREAD = 6.0
"""Neighbourhood whose colours the subject is taken to have at the outline, standard deviation, pixels."""
DEVIATION = 0.01
"""Least standard deviation of the subject's colours at the outline."""
ALIKE = 3.0
"""Price, as a logarithm of likelihood, of an opacity that differs by 1 from those around it."""
BESIDE = 1.5
"""Surroundings of a pixel that `ALIKE` compares, standard deviation, pixels."""
SOLID = 2.0
"""Bonus, as a logarithm of likelihood, of an opacity of 1."""
BELIEVED = 0.2
"""Standard deviation of an opacity from what the subject's Gaussians say."""
STEPS = 21
"""Opacities from 0 to 1 that are compared."""
TINY = float(np.finfo(np.float32).eps)
"""No mean is formed by a smaller weight, no variance is smaller."""


def opacity_before(
    image: Array,
    plate: Array,
    inside: Mask,
    unknown: Mask,
    noise: float | Array,
    start: tuple[Array, Array] | None = None,
) -> Array:
    """(H, W) in [0, 1]: 1 on `inside`, 0 beyond it and `unknown`.

    Args:
        image, plate: (H, W, 3) in [0, 1].
        inside: (H, W) surely the subject's, somewhere.
        unknown: (H, W) where opacity is asked for.
        noise: standard deviation of both, of values in [0, 1]; or (H, W), each pixel's.
        start: (H, W) opacity of the subject's Gaussians, and how far it is believed, from 0 to 1: it decides where
            subject and plate have one colour.
    """
    variance = np.broadcast_to(np.square(np.float32(noise)) + np.float32(TINY), inside.shape)
    opacity, unknown = inside.astype(np.float32), unknown & ~inside
    colours, known = image.copy(), ~unknown
    away = np.ceil(np.asarray(ndimage.distance_transform_edt(~inside)))
    subject = _NearbyColours(colours, opacity)
    for distance in np.unique(away[unknown]):
        ring = np.nonzero(unknown & (away == distance))
        mean, covariance = subject.around(ring)
        sure = known.astype(np.float32)
        beside = _blurred(opacity * sure, BESIDE)[ring]
        beside /= np.maximum(_blurred(sure, BESIDE)[ring], TINY)
        believed = None if start is None else (start[0][ring], start[1][ring])
        opacity[ring], colours[ring] = _likeliest(
            image[ring], plate[ring], mean, covariance, beside, variance[ring][:, None], believed
        )
        subject.add(ring, colours[ring], opacity[ring])
        known[ring] = True
    return opacity


def _blurred(values: Array, width: float) -> Array:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), width), np.float32)


class _NearbyColours:
    """Mean and covariance of the subject's colours around pixels, as far as these are known: by a Gaussian blur at half
    the size, where a wide one is the same.

    Args:
        colours: (H, W, 3).
        opacity: (H, W), 0 where it is not known yet; a pixel counts by its square.
    """

    def __init__(self, colours: Array, opacity: Array) -> None:
        self._sums = np.zeros(((opacity.shape[0] + 1) // 2, (opacity.shape[1] + 1) // 2, 10), np.float32)
        there = np.nonzero(opacity)
        self.add(there, colours[there], opacity[there])

    def add(self, pixels: tuple[NDArray[np.int64], ...], colours: Array, opacity: Array) -> None:
        """Pixels (P,), rows and columns, with their colours (P, 3) and opacity (P,)."""
        one, other = np.triu_indices(3)
        found = np.concatenate([np.ones_like(colours[:, :1]), colours, colours[:, one] * colours[:, other]], 1)
        rows, columns = (part // 2 for part in pixels)
        np.add.at(self._sums, (rows, columns), found * (0.25 * opacity[:, None] ** 2))

    def around(self, pixels: tuple[NDArray[np.int64], ...]) -> tuple[Array, Array]:
        """(P, 3) and (P, 3, 3)."""
        one, other = np.triu_indices(3)
        wide = _blurred(self._sums, SPREAD / 2)
        here = _between(wide, pixels)
        if not (here[:, 0] > TINY).all():  # too far from what is known: as the nearest that is not
            near = ndimage.distance_transform_edt(wide[..., 0] <= TINY, return_distances=False, return_indices=True)
            here = _between(wide[tuple(near)], pixels)
        mean = here[:, 1:4] / here[:, :1]
        covariance = np.empty((len(here), 3, 3), np.float32)
        covariance[:, one, other] = here[:, 4:] / here[:, :1] - mean[:, one] * mean[:, other]
        covariance[:, other, one] = covariance[:, one, other]
        return mean, covariance + DEVIATION**2 * np.eye(3, dtype=np.float32)


def _between(half: Array, pixels: tuple[NDArray[np.int64], ...]) -> Array:
    """(P, Q): what an image of half the size (h, w, Q) has at pixels of the whole, bilinear, clamped."""
    (i, di), (j, dj) = (_place(part, size) for part, size in zip(pixels, half.shape, strict=False))
    low, right = np.minimum(i + 1, half.shape[0] - 1), np.minimum(j + 1, half.shape[1] - 1)
    upper = half[i, j] * (1 - dj) + half[i, right] * dj
    return np.asarray(upper * (1 - di) + (half[low, j] * (1 - dj) + half[low, right] * dj) * di)


def _place(pixels: NDArray[np.int64], size: int) -> tuple[NDArray[np.int64], Array]:
    place = np.clip(0.5 * pixels - 0.25, 0, size - 1).astype(np.float32)
    first = place.astype(np.int64)
    return first, (place - first)[:, None]


def _likeliest(
    image: Array,
    plate: Array,
    mean: Array,
    covariance: Array,
    beside: Array,
    variance: Array,
    start: tuple[Array, Array] | None,
) -> tuple[Array, Array]:
    """Expected opacity (P,), and the subject's colour (P, 3) with it.

    Args:
        image, plate, mean: (P, 3).
        covariance: (P, 3, 3).
        beside: (P,) mean opacity of what is known around.
        variance: (P, 1) of image and plate.
        start: (P,) opacity of the Gaussians, and how far it is believed.
    """
    steps = np.linspace(0, 1, STEPS, dtype=np.float32)
    variances, axes = np.linalg.eigh(covariance)
    variances = np.maximum(variances, TINY)
    across = np.einsum("pij,pi->pj", axes, mean - plate)
    off = np.einsum("pij,pi->pj", axes, image - plate)
    spread = steps[:, None, None] ** 2 * variances + variance
    error = off - steps[:, None, None] * across
    chance = -0.5 * (error**2 / spread + np.log(spread)).sum(-1)
    chance -= ALIKE * np.abs(steps[:, None] - beside)
    chance[-1] += SOLID
    if start is not None:
        chance -= 0.5 * start[1] * np.square((steps[:, None] - start[0]) / BELIEVED)
    chance = np.exp(chance - chance.max(0))
    opacity = (chance * steps[:, None]).sum(0) / chance.sum(0)
    gain = opacity[:, None] * variances / (opacity[:, None] ** 2 * variances + variance)
    colour = mean + np.einsum("pij,pj->pi", axes, gain * (off - opacity[:, None] * across))
    return opacity.astype(np.float32), np.clip(colour, 0, 1).astype(np.float32)
