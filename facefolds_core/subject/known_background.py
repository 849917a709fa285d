"""Opacity before a known background: Bayesian matting (Chuang et al. 2001) where B is the clean plate.

A pixel shows I = a F + (1 - a) B. Of the subject's colour F only this is known: nearby it has such a mean and such a
covariance, so I is normal with mean a m + (1 - a) B and covariance a^2 S + n^2, n the pictures' noise. Pixels are asked
ring by ring, from the subject's inside outwards; each ring's colours tell the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class PlateParams:
    """Pictures beside their clean plates: what differs is the subject.

    Attributes:
        blur: blur of both before they are compared, standard deviation, pixels.
        different: difference of a colour, in [0, 1], above which a pixel may be the subject's.
        least: things smaller than this share of the largest are taken for shadows or reflections.
        outline: pixels inside of the outline within which opacity is found from colours.
        beyond: pixels outside of the outline within which opacity is found from colours.
        faint: least difference of a colour that shows a little of the subject beyond the outline.
        faint_noise: least value of `faint` in multiples of the pictures' noise.
        noise: least standard deviation of noise that is reckoned with.
        quiet: noise is measured at least so many pixels beyond the outline.
        spread: neighbourhood whose colours the subject is taken to have at the outline, standard deviation,
            pixels.
        deviation: least standard deviation of the subject's colours at the outline.
        alike: price, as a logarithm of likelihood, of an opacity that differs by 1 from those around it.
        beside: surroundings of a pixel that `alike` compares, standard deviation, pixels.
        solid: bonus, as a logarithm of likelihood, of an opacity of 1.
        believed: standard deviation of an opacity from what the subject's Gaussians say.
        steps: opacities from 0 to 1 that are compared.
        weight: of the opacity that is expected so, beside the differences from its neighbours' in the closed form.
    """

    blur: float = 0.7
    different: float = 0.05
    least: float = 0.05
    outline: int = 8
    beyond: int = 6
    faint: float = 0.012
    faint_noise: float = 2.5
    noise: float = 0.01
    quiet: int = 12
    spread: float = 6.0
    deviation: float = 0.01
    alike: float = 3.0
    beside: float = 1.5
    solid: float = 2.0
    believed: float = 0.2
    steps: int = 21
    weight: float = 1.0


TINY = float(np.finfo(np.float32).eps)
"""No mean is formed by a smaller weight, no variance is smaller."""


def opacity_before(
    image: Array,
    plate: Array,
    inside: Mask,
    unknown: Mask,
    noise: float | Array,
    params: PlateParams,
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
    for distance in np.unique(away[unknown]):
        ring = np.nonzero(unknown & (away == distance))
        mean, covariance = _nearby(colours, opacity**2 * known, ring, params)
        sure = known.astype(np.float32)
        beside = _blurred(opacity * sure, params.beside)[ring]
        beside /= np.maximum(_blurred(sure, params.beside)[ring], TINY)
        believed = None if start is None else (start[0][ring], start[1][ring])
        opacity[ring], colours[ring] = _likeliest(
            image[ring], plate[ring], mean, covariance, beside, variance[ring][:, None], params, believed
        )
        known[ring] = True
    return opacity


def _blurred(values: Array, width: float) -> Array:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), width), np.float32)


def _nearby(
    colours: Array, weight: Array, ring: tuple[NDArray[np.int64], ...], params: PlateParams
) -> tuple[Array, Array]:
    """Mean (P, 3) and covariance (P, 3, 3) of the subject's colours around the ring's pixels."""
    one, other = np.triu_indices(3)
    first = np.empty((*weight.shape, 4), np.float32)
    first[..., 0] = weight
    np.multiply(colours, weight[..., None], out=first[..., 1:])
    weighted = first[..., 1:]
    # Four channels at a time: OpenCV resizes no more by what is not whole.
    pairs = [(one[:4], other[:4]), (one[4:], other[4:])]
    parts = [first, *(weighted[..., i] * colours[..., j] for i, j in pairs)]
    wide = [_widely(part, params.spread) for part in parts]
    if not (wide[0][..., 0][ring] > TINY).all():  # too far from the inside: as the nearest that is not
        near = ndimage.distance_transform_edt(wide[0][..., 0] <= TINY, return_distances=False, return_indices=True)
        wide = [part[tuple(near)] for part in wide]
    here = np.concatenate([part[ring] for part in wide], -1)
    mean = here[:, 1:4] / here[:, :1]
    covariance = np.empty((len(here), 3, 3), np.float32)
    covariance[:, one, other] = here[:, 4:] / here[:, :1] - mean[:, one] * mean[:, other]
    covariance[:, other, one] = covariance[:, one, other]
    return mean, covariance + params.deviation**2 * np.eye(3, dtype=np.float32)


def _widely(values: Array, width: float) -> Array:
    """(H, W, Q) blurred, Q at most 4: at half the size, where a wide blur is the same, and four times as fast."""
    height, columns = values.shape[:2]
    half = (max(1, columns // 2), max(1, height // 2))
    small = _blurred(np.asarray(cv2.resize(values, half, interpolation=cv2.INTER_AREA)), width / 2)
    return np.asarray(cv2.resize(small, (columns, height), interpolation=cv2.INTER_LINEAR))


def _likeliest(
    image: Array,
    plate: Array,
    mean: Array,
    covariance: Array,
    beside: Array,
    variance: Array,
    params: PlateParams,
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
    steps = np.linspace(0, 1, params.steps, dtype=np.float32)
    variances, axes = np.linalg.eigh(covariance)
    variances = np.maximum(variances, TINY)
    across = np.einsum("pij,pi->pj", axes, mean - plate)
    off = np.einsum("pij,pi->pj", axes, image - plate)
    spread = steps[:, None, None] ** 2 * variances + variance
    error = off - steps[:, None, None] * across
    chance = -0.5 * (error**2 / spread + np.log(spread)).sum(-1)
    chance -= params.alike * np.abs(steps[:, None] - beside)
    chance[-1] += params.solid
    if start is not None:
        chance -= 0.5 * start[1] * np.square((steps[:, None] - start[0]) / params.believed)
    chance = np.exp(chance - chance.max(0))
    opacity = (chance * steps[:, None]).sum(0) / chance.sum(0)
    gain = opacity[:, None] * variances / (opacity[:, None] ** 2 * variances + variance)
    colour = mean + np.einsum("pij,pj->pi", axes, gain * (off - opacity[:, None] * across))
    return opacity.astype(np.float32), np.clip(colour, 0, 1).astype(np.float32)
