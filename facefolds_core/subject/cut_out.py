"""The subject's silhouette in one picture: roughly from its Gaussians, to the pixel from the picture's colours."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.closed_form import closed_form
from facefolds_core.subject.found import DOUBT
from facefolds_core.subject.known_background import NOISE, TINY, opacity_before

Array = NDArray[np.float32]
Image = NDArray[np.uint8]
Bool = NDArray[np.bool_]

INSIDE, OUTSIDE = 0.9, 0.3
"""Opacities of the Gaussians above and below which they are believed,"""
BAND = 2.0
"""and so many pixels off from where they are neither, at a picture of 384 pixels."""
ALIKE = 0.02
"""Where a picture, blurred by `BAND`, differs by less from what stands behind, of values in [0, 1], Gaussians are not
sure (`INSIDE`) when it votes."""
SOFT, EMPTY = 5.0, 0.1
"""Pixels on both sides of an outline in which opacity is not 0 or 1, at a picture of 384 pixels; twice as many where
the Gaussians are neither opaque (`INSIDE`) nor of less opacity than the second."""
BELIEVED = 1.0
"""What the colour of what stands behind says of a pixel's opacity weighs so much where it is known exactly, beside the
differences from its neighbours' in the closed form."""
BESIDE = 6.0
"""Pixels beside the subject by which that is told, standard deviation, at a picture of 384 pixels."""
MOST_NOISE = 0.1
"""Largest deviation of what stands behind that is reckoned with, of values in [0, 1]."""
DARK = 8.0
"""Values of 255 from which on GrabCut sees differences by their share: dark hair before a dark room differs by few."""

AROUND = 10
"""Colours of what stands behind are told so far around the subject, in widths of the band: the rest is far away, and
costs time."""

SAMPLES = 3000
"""Pixels of each picture, of the subject and of what stands behind, by which their colours are known."""

LOGARITHM = np.rint(255 * np.log1p(np.arange(256) / DARK) / np.log1p(255 / DARK)).astype(np.uint8)


@dataclass(frozen=True)
class Colours:
    """What colours the subject has in all pictures, and what stands behind: GrabCut's mixtures of Gaussians.

    Of one picture alone they would be wrong where it shows hair at its edge, whose Gaussians few cameras saw: they are
    transparent there, and the hair would be taken for the room.

    Attributes:
        behind, subject: (1, 65) float64 as OpenCV has them.
    """

    behind: NDArray[np.float64]
    subject: NDArray[np.float64]


def colours_of(seen: Iterable[tuple[Image, Array, Camera]]) -> Colours | None:
    """Of pictures (H, W, 3), with the opacity (H, W) of the subject's Gaussians in each; None where no pixel is surely
    the subject's, or none is surely not."""
    rows, labels, random = list[Image](), list[int](), np.random.default_rng(0)
    for picture, start, camera in seen:
        inside, near = _sure(start, camera)
        image = _logarithmic(picture)
        for chosen, label in ((inside, cv2.GC_FGD), (~near, cv2.GC_BGD)):
            if chosen.any():
                rows.append(random.choice(image[chosen], SAMPLES))
                labels.append(label)
    if len(set(labels)) < 2:
        return None
    cv2.setRNGSeed(0)  # its clusters begin at random
    models, known = np.zeros((2, 1, 65)), np.repeat(np.array(labels, np.uint8)[:, None], SAMPLES, 1)
    cv2.grabCut(np.stack(rows), known, (0, 0, 1, 1), models[0], models[1], 1, cv2.GC_INIT_WITH_MASK)
    return Colours(*models)


def doubted(picture: Image, start: Array, behind: Array, camera: Camera) -> Array:
    """(H, W) opacity of the subject's Gaussians, nowhere sure where a picture (H, W, 3) looks like what stands behind.

    Args:
        start: (H, W) as they say.
        behind: (H, W, 3) what stands behind them.
    """
    differs = _near((picture / 255 - np.clip(behind, 0, 1)).astype(np.float32), pixels(BAND, camera))
    return np.where(np.abs(differs).max(-1) < ALIKE, np.minimum(start, DOUBT), start)


def cut_out(picture: Image, start: Array, camera: Camera, colours: Colours | None) -> Bool:
    """(H, W) silhouette of the subject in a picture (H, W, 3): GrabCut (Rother et al. 2004) between what is surely its
    and surely not, without holes.

    Args:
        start: (H, W) opacity of its Gaussians.
        colours: of `colours_of`.
    """
    inside, near = _sure(start, camera)
    labels = np.where(start > 0.5, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    labels[inside], labels[~near] = cv2.GC_FGD, cv2.GC_BGD
    cut = start > 0.5
    if near.any() and not near.all() and cut.any() and colours is not None:
        part = around(near, 1)
        own, models = labels[part].copy(), (colours.behind.copy(), colours.subject.copy())
        cv2.grabCut(_logarithmic(picture[part]), own, (0, 0, 1, 1), *models, 1, cv2.GC_EVAL_FREEZE_MODEL)
        cut = np.zeros_like(cut)
        cut[part] = (own == cv2.GC_FGD) | (own == cv2.GC_PR_FGD)
    return filled(cut, start)


def filled(cut: Bool, opacity: Array | None) -> Bool:
    """(H, W) a silhouette without holes, but for those that its Gaussians have, too: through glasses one sees the room.

    Args:
        opacity: (H, W) of the Gaussians, once they are known.
    """
    whole = np.asarray(ndimage.binary_fill_holes(cut))
    if opacity is None:
        return whole
    solid = opacity > 0.5
    return np.asarray(cut | (whole & ~(ndimage.binary_fill_holes(solid) & ~solid)))


def _sure(start: Array, camera: Camera) -> tuple[Bool, Bool]:
    """(H, W) what is surely the subject, and what may be."""
    radius = pixels(BAND, camera)
    inside = grown((start < INSIDE).astype(np.uint8), radius) == 0
    return inside, grown((start > OUTSIDE).astype(np.uint8), radius) > 0


def _logarithmic(picture: Image) -> Image:
    """As GrabCut sees it: BGR."""
    return np.asarray(cv2.LUT(np.ascontiguousarray(picture[..., ::-1]), LOGARITHM), np.uint8)


def softened(picture: Image, cut: Bool, start: Array, behind: Array, camera: Camera) -> Array:
    """(H, W) opacity in [0, 1] of the subject in a picture (H, W, 3): 1 and 0 away from its outline; along it by the
    closed form of Levin et al. (2008, "A Closed-Form Solution to Natural Image Matting", eq. 12), where within
    3 x 3 pixels colours lie on a line between the subject's and the room's. Where it is known what stands behind, what
    `opacity_before` says of it is asked as well.

    Args:
        start: (H, W) opacity of its Gaussians.
        behind: (H, W, 3) what stands behind them.
    """
    outside, own, radius = (~cut).astype(np.uint8), cut.astype(np.uint8), pixels(SOFT, camera)
    inside = (grown(outside, 2 * radius) == 0) | ((grown(outside, radius) == 0) & (start >= INSIDE))
    empty = (grown(own, 2 * radius) == 0) | ((grown(own, radius) == 0) & (start <= EMPTY))
    if not inside.any() or not empty.any():
        return cut.astype(np.float32)
    part, opacity = around(~empty, AROUND * radius), np.zeros(cut.shape, np.float32)
    colours, room = picture[part].astype(np.float32) / np.float32(255), np.clip(behind[part], 0, 1)
    noise = _noise(colours, room, grown(own[part], 2 * radius) == 0, pixels(BESIDE, camera), radius)
    unknown = ~(inside | empty)[part]
    before = opacity_before(colours, room, inside[part], unknown, noise)
    believed = BELIEVED * (NOISE / noise) ** 4
    opacity[part] = closed_form(colours, inside[part], unknown, before, believed)
    return opacity


def _noise(colours: Array, room: Array, far: Bool, beside: int, radius: int) -> Array:
    """(H, W) how well it is known what stands behind, as a deviation: how much the picture varies beside the subject,
    and how far what is said to stand behind is off its mean there. Hidden by the subject from most cameras, that is a
    guess.

    Args:
        colours, room: (H, W, 3) of the picture, and said to stand behind.
        far: (H, W) surely not the subject.
        beside, radius: deviations of the surroundings, pixels: of what is beside, of what is behind.
    """
    weight = _near(far.astype(np.float32), beside)
    nearest = ndimage.distance_transform_edt(weight <= TINY, return_distances=False, return_indices=True)
    mean, square = (
        (_near(one * far[..., None], beside) / np.maximum(weight, TINY)[..., None])[tuple(nearest)]
        for one in (colours, colours**2)
    )
    off = _near(np.abs(room - mean), radius)
    variance = np.maximum(square - mean**2, 0).mean(-1) + np.square(off).mean(-1)
    return np.asarray(np.clip(np.sqrt(variance), NOISE, MOST_NOISE), np.float32)


def _near(values: Array, width: float) -> Array:
    """(H, W) or (H, W, Q), blurred."""
    return np.asarray(cv2.GaussianBlur(values, (0, 0), width), np.float32)


def around(mask: Bool, margin: int) -> tuple[slice, slice]:
    """Rows and columns of what is true in (H, W), and so many more on each side."""
    rows, columns = np.nonzero(mask.any(1))[0], np.nonzero(mask.any(0))[0]
    return (
        slice(max(0, int(rows[0]) - margin), int(rows[-1]) + 1 + margin),
        slice(max(0, int(columns[0]) - margin), int(columns[-1]) + 1 + margin),
    )


def agreement(cut: Bool, other: Bool) -> float:
    """IoU of silhouettes (H, W); 1 of two empty ones."""
    union = int((cut | other).sum())
    return int((cut & other).sum()) / union if union else 1.0


def pixels(width: float, camera: Camera) -> int:
    """A width given for pictures of 384 pixels, in this camera's."""
    return max(1, round(width * max(camera.width, camera.height) / 384))


def grown(silhouette: Image, radius: int) -> Image:
    """(H, W) 0 or 1, dilated by so many pixels."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    return np.asarray(cv2.dilate(silhouette, disc), np.uint8)
