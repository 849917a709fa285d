"""Which Gaussians are the subject: the connected body at the cameras' common centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.captures.scene import REACH, Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.density import longest_axes
from facefolds_core.subject.drawing import draw, view_of
from facefolds_core.subject.sight import seen_by
from facefolds_core.subject.splats import Splats

Array = NDArray[np.float32]
Bool = NDArray[np.bool_]


FINEST, COARSEST = 100, 8
"""Cells in a radius of the ball, at most and at least."""
AROUND = 2.0
"""Radius, in those of the ball, within which a subject that is known in the pictures may go on, and any subject towards
the cameras: their common point may lie at its back, as of a head on a wall."""
TOWARDS = 0.5
"""Least cosine of the angle to the cameras' mean direction, times that mean's length: 1 where all stand at one place, 0
where they stand all around. What is nearer to them than the subject, and joined to it, is the subject's."""
JOINED = 2.2
"""Side of the cells in which Gaussians are connected, in median lengths of those in the ball."""
SOLID = 0.3
"""Opacity from which on a Gaussian connects."""
NEAR = 0.1
"""Standard deviation of the neighbourhood of the origin in which the body is the heaviest, units."""
VIEWS = 3
"""Training cameras that must have a Gaussian in their pictures, at least; all, where there are fewer."""


def subject_of(splats: Splats, scene: Scene) -> Bool:
    """(N,) whether a Gaussian is the subject's, of those of a whole scene."""
    return _body(splats, near_enough(splats, scene), scene.radius or REACH)


def joined(splats: Splats, scene: Scene) -> Bool:
    """(N,) whether a Gaussian is joined to the subject, of those fitted to it alone; all, if none is solid."""
    reach = AROUND * (scene.radius or REACH)
    body = _body(splats, np.linalg.norm(splats.means, axis=1) < reach, reach)
    return body if body.any() else np.ones(len(splats), bool)


def _body(splats: Splats, possible: Bool, reach: float) -> Bool:
    """(N,) the heaviest connected body near the origin among those that are possible, in the ball of `reach`."""
    solid = possible & (splats.opacities > SOLID)
    if not solid.any():
        return solid
    voxel = float(np.clip(JOINED * np.median(splats.sizes[solid].max(1)), reach / FINEST, reach / COARSEST))
    low = splats.means[possible].min(0) - 1.5 * voxel
    cells = ((splats.means - low) / voxel).astype(np.int64)
    weight = np.zeros(tuple(cells[possible].max(0) + 2), np.float32)
    cells = cells.clip(0, np.array(weight.shape) - 1)
    area = np.prod(np.sort(splats.sizes, 1)[:, 1:], 1) / voxel**2  # of the face that it shows
    _scatter(weight, splats, solid, np.minimum(area, 4.0) * splats.opacities, low, voxel)
    labels, count = ndimage.label(weight > 0, np.ones((3, 3, 3)))
    x, y, z = ((np.arange(size) + 0.5) * voxel + low[axis] for axis, size in enumerate(weight.shape))
    square = x[:, None, None] ** 2 + y[:, None] ** 2 + z**2
    mass = ndimage.sum_labels(weight * np.exp(-0.5 * square / NEAR**2), labels, np.arange(1, count + 1))
    body = ndimage.binary_dilation(labels == 1 + int(np.argmax(mass)), iterations=1)
    return np.asarray(possible & body[tuple(cells.T)])


def near_enough(splats: Splats, scene: Scene) -> Bool:
    """(N,) Gaussians in the subject's ball, or before it, that enough cameras have in their pictures."""
    reach = scene.radius or REACH
    cameras, away = scene.views_of("train"), np.linalg.norm(splats.means, axis=1)
    mean = np.mean([camera.centre / np.linalg.norm(camera.centre) for camera in cameras], 0)
    before = splats.means @ mean > TOWARDS * away
    inside = away < np.where(before & (scene.radius is None), AROUND * reach, reach)
    seen = seen_by(cameras, splats.means.astype(np.float64))
    return np.asarray(inside & (seen >= min(VIEWS, len(cameras))))


def _scatter(weight: Array, splats: Splats, chosen: Bool, amount: Array, low: Array, voxel: float) -> None:
    """Put Gaussians into cells: at their means, and one standard deviation to both sides along their longest axes."""
    ends = longest_axes(splats.values[chosen])
    for side in (-1, 0, 1):
        places = splats.means[chosen] + side * ends
        cells = np.floor((places - low) / voxel).astype(np.int64)
        inside = ((cells >= 0) & (cells < weight.shape)).all(1)
        np.add.at(weight, tuple(cells[inside].T), amount[chosen][inside] / 3)


def opacity_of(splats: Splats, subject: Bool, camera: Camera) -> Array:
    """(H, W) opacity of the subject as the camera sees it: what stands before it covers it."""
    drawing = draw(splats.values, view_of(camera))
    marks = np.repeat(subject[:, None].astype(np.float32), 3, 1)
    return np.asarray(drawing.blended(marks).picture()[0][..., 0])


def background(splats: Splats, subject: Bool, camera: Camera) -> Array:
    """(H, W, 3) RGB of what stands behind: everything but the subject."""
    rgb, light = draw(splats.part(~subject).values, view_of(camera)).picture()
    return np.asarray(rgb + light[..., None] * splats.background)
