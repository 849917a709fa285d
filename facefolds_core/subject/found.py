"""Which Gaussians are the subject: the connected body at the cameras' common centre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from facefolds_core.captures.scene import REACH, Scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.drawing import draw, view_of
from facefolds_core.subject.sight import seen_by
from facefolds_core.subject.splats import Splats, axes_of, longest_axes

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
VIEWS = 2
"""Training cameras that must have a Gaussian in their pictures, at least; all, where there are fewer. Shoulders at the
pictures' edges are in two."""
SURROUNDING = 0.5
"""Length of the mean direction in which a body leaves the ball, below which it leaves it all around: a wall that
surrounds the subject has 0, a neck and chest 0.8."""
FACE = tuple((a, b) for a in np.linspace(-1.0, 1.0, 7) for b in np.linspace(-1.0, 1.0, 7) if np.hypot(a, b) <= 1.0)
"""Points of a Gaussian's face, standard deviations along its two longer axes. Of 1.5 instead of 1 room beside hair is
joined to it."""
DIRECTIONS = 3
"""Directions are told apart by so many steps from the middle to each side."""
DOUBT = 0.7
"""Opacity as which counts what may be of the room: too little to be surely the subject's."""


def reference_frame(scene: Scene) -> int:
    """The frame in which the subject is found: the middle one; of a head that turns the one nearest its mean pose."""
    return scene.num_frames // 2 if scene.poses is None else scene.poses.nearest()


def no_subject(place: str, folder: Path | None = None) -> UserError:
    return UserError(
        "no subject was found in the images",
        file=folder,
        place=place,
        expected="something near the cameras' common point that stands out from what lies behind it",
        found="nothing that several cameras agree on",
        remedy="look at the pictures of the normalised scene: are they dark, empty or all alike? Then check the "
        "calibration, or take other frames",
    )


def subject_of(splats: Splats, scene: Scene) -> Bool:
    """(N,) whether a Gaussian is the subject's, of those of a whole scene."""
    return connected(splats, near_enough(splats, scene), scene)


def connected(splats: Splats, possible: Bool, scene: Scene) -> Bool:
    """(N,) the body among Gaussians that are possible."""
    return _body(splats, possible, scene.radius or REACH)


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
    voxel = _voxel(splats, solid, reach)
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
    return np.asarray(inside & _seen(splats, scene))


def _seen(splats: Splats, scene: Scene) -> Bool:
    """(N,) whether enough cameras have a Gaussian in their pictures."""
    cameras = scene.views_of("train")
    return np.asarray(seen_by(cameras, splats.means.astype(np.float64)) >= min(VIEWS, len(cameras)))


def belief(splats: Splats, scene: Scene, body: Bool) -> Array:
    """(N,) 1 for what is surely the subject's among Gaussians of a whole scene, DOUBT for what may be, 0 for the rest.

    A body that leaves its ball all around goes on as a wall, of which the ball has cut out a disc. Then only what is
    more than half as far from all that goes on, along the body's own surface, as its farthest part is surely the
    subject's; pictures are asked about the rest. A ball that the user gives holds the subject, whatever goes on there.

    Args:
        body: (N,) of `subject_of`.
    """
    reach, sure = REACH, body.astype(np.float32)
    if scene.radius is not None:
        return sure
    away = np.linalg.norm(splats.means, axis=1)
    solid = (splats.opacities > SOLID) & (body | ((away < AROUND * reach) & _seen(splats, scene)))
    if not (body & solid).any():
        return sure
    voxel = _voxel(splats, body & solid, reach)
    steps = _steps(splats.means[solid], longest_axes(splats.values[solid]), ~body[solid] & (away[solid] > reach), voxel)
    own, near = body[solid] & np.isfinite(steps), body[solid] & (steps <= 2)
    ways = np.unique(np.rint(DIRECTIONS * splats.means[solid][near] / away[solid][near][:, None]), axis=0)
    if not len(ways) or np.linalg.norm((ways / np.linalg.norm(ways, axis=1)[:, None]).mean(0)) > SURROUNDING:
        return sure
    doubtful = np.flatnonzero(solid)[own & (steps <= 0.5 * steps[own].max())]
    sure[doubtful] = DOUBT
    return sure


def _voxel(splats: Splats, solid: Bool, reach: float) -> float:
    """Side of cells in which Gaussians touch."""
    return float(np.clip(JOINED * np.median(splats.sizes[solid].max(1)), reach / FINEST, reach / COARSEST))


def _steps(means: Array, ends: Array, first: Bool, voxel: float) -> Array:
    """(N,) float64: from cell to touching cell, how many steps Gaussians are from the first; inf if not joined to them.

    Args:
        means, ends: (N, 3) of Gaussians, which are in the cells at their means and at that to both sides of them.
        first: (N,) where the way begins.
        voxel: side of a cell.
    """
    if not first.any():
        return np.full(len(means), np.inf)
    places = np.floor(np.concatenate([means, means - ends, means + ends]) / voxel).astype(np.int64)
    cells, cell = np.unique(places, axis=0, return_inverse=True)
    cell = cell.reshape(3, -1)
    touching = KDTree(cells).query_pairs(1.8, output_type="ndarray")  # sides, edges and corners: root of 3 at most
    pairs = np.concatenate([touching, cell[[0, 1]].T, cell[[0, 2]].T])
    graph = coo_array((np.ones(len(pairs), np.int8), pairs.T), (len(cells), len(cells)))
    far = dijkstra(graph, False, np.unique(cell[0][first]), unweighted=True, min_only=True)
    return np.asarray(far[cell[0]])


def _scatter(weight: Array, splats: Splats, chosen: Bool, amount: Array, low: Array, voxel: float) -> None:
    """Put Gaussians into cells, by points on their faces: smooth skin has few large ones, which touch at their rims."""
    axes = axes_of(splats.values[chosen])
    for along, across in FACE:
        places = splats.means[chosen] + along * axes[:, 0] + across * axes[:, 1]
        cells = np.floor((places - low) / voxel).astype(np.int64)
        inside = ((cells >= 0) & (cells < weight.shape)).all(1)
        np.add.at(weight, tuple(cells[inside].T), amount[chosen][inside] / len(FACE))


def opacity_of(splats: Splats, subject: Bool | Array, camera: Camera) -> Array:
    """(H, W) opacity of the subject as the camera sees it: what stands before it covers it.

    Args:
        subject: (N,) which Gaussians are its, or how far each is believed to be.
    """
    drawing = draw(splats.values, view_of(camera))
    marks = np.repeat(subject[:, None].astype(np.float32), 3, 1)
    return np.asarray(drawing.blended(marks).picture()[0][..., 0])


def background(splats: Splats, subject: Bool, camera: Camera) -> Array:
    """(H, W, 3) RGB of what stands behind: everything but the subject."""
    rgb, light = draw(splats.part(~subject).values, view_of(camera)).picture()
    return np.asarray(rgb + light[..., None] * splats.background)
