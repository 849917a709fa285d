"""What the explicit model takes from the scene: window, starting radii, texels. Each by a rule stated here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.asset.filmed import ROUND, filmed_view
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window, closed
from facefolds_core.geometry.torso import Torso
from facefolds_core.params import ExplicitParams, GeometryParams, StartParams
from facefolds_core.rendering.compositing import transmittance_before
from facefolds_core.subject.found import reference_frame
from facefolds_core.subject.outline import (
    MIN_RADIUS,
    Profile,
    choose_chart,
    grid_shape,
    profile,
    visible_points,
    whole_window,
    window_uv,
)
from facefolds_core.subject.sight import seen_by
from facefolds_core.subject.splats import Splats
from facefolds_core.subject.storage import FoundSubject
from facefolds_core.subject.volume import CELLS, COARSE, Volume, volume_of
from facefolds_core.training.explicit.offsets import Offsets, offsets, over_frames
from facefolds_core.training.explicit.second_surface import LAYERS, large, second_surface
from facefolds_core.training.explicit.tracked import (
    FAR,
    OPACITY,
    REACH,
    TRUST,
    WELL_SEEN,
    blend,
    mesh_radii,
    some_frames,
    trusted_surface,
)

Array = NDArray[np.float64]

FINEST = 0.7
"""Voxels are no smaller than so many pixels of the median camera."""
LEAST_NODES = 8
"""Rows and columns of the radius maps, at least."""
MIN_VIEW_SHARE = 0.06
"""Of the training cameras: what a smaller share sees of a tracked mesh is its word alone."""
WINDOW_NODES = 192
"""Rows and columns of (u, v) at which it is asked whether there is something of the subject."""
NEAR_NODES = 4
"""Of these nodes around the points that cameras see: as far apart as a node or farther, these leave gaps."""
LEAST_PATCH = 0.01
"""Of the nodes that hold something: a smaller patch is one point that a camera saw behind the subject, and would move a
border of the window by half a radian."""
WINDOW_MARGIN = 0.04
"""Margin of the window in u and v beyond what holds the subject."""
HALFWIDTH_PIXELS = 1.5, 8.0
"""The least and the largest distance of the outermost layer from the surface, pixels of the median camera: photos do
not show where the surface lies within less. `geometry.halfwidth` is always allowed."""
RADIUS_QUANTILE = 0.9
"""`textures.pixels_per_texel` holds on a sphere of this quantile of the radii of what is opaque: nearly the farthest,
where texels are largest."""


@dataclass(frozen=True)
class Fit:
    """What was chosen, and why. Maps are (rows, columns) at the nodes of the radius maps.

    Attributes:
        chart: of (u, v) and radii.
        window: (u0, u1, v0, v1).
        offsets: from the surface about which the layers lie: the mean of a few frames'.
        halfwidth: distance of the outermost and the innermost layer from it, units, where the surface stands still.
        reach: how much farther they lie where it moves, units; added to any multiple of the halfwidth.
        second: middle radii of a second surface beneath the first, units; 0 where there is none.
        trust: offsets of the layers from the start are shrunk by this much towards 0, units.
        rgb: of the start, (rows, columns, 3).
        texels: (H, W) of the finest textures.
        reasons: one a choice, and the notes.
        notes: what a user should know at once.
        volume: the subject, for what each layer begins with.
        losses: of the candidates for the chart, the share of the visible surface that each loses.
        start_psnr: of the subject's Gaussians over the training pictures, dB.
        torso: what of the subject stays in the room while the head turns.
    """

    chart: Chart
    window: Window
    offsets: Offsets
    halfwidth: Array
    reach: Array
    second: Array
    trust: Array
    rgb: Array
    texels: tuple[int, int]
    reasons: tuple[Fact, ...]
    notes: tuple[Fact, ...]
    volume: Volume
    losses: dict[Chart, float]
    start_psnr: float
    torso: Torso | None = None


def fit_scene(scene: Scene, subject: FoundSubject, params: ExplicitParams, others: Sequence[Splats] = ()) -> Fit:
    """Centre, window, radii, spacing and texels from the volume, and from the tracked mesh where there is one.

    Args:
        subject: as it was found.
        others: its Gaussians in a few other frames.
    """
    start, geometry = params.start, params.geometry
    volume, coarse = (volume_in(scene, subject.splats, cells) for cells in (CELLS, COARSE))
    cameras = [scene.camera_in_head(i, reference_frame(scene)) for i in scene.indices("train")]
    views = [visible_points(coarse, [camera]) for camera in cameras]
    visible = np.concatenate(views)
    around = filmed_around(cameras)
    chart, losses = choose_chart(coarse, views, start, around)
    surface, notes = trusted_surface(scene, coarse, chart, start)
    vertices = None if surface is None else surface[0].astype(np.float64)
    window = fit_window(coarse, chart, visible, vertices, start, around)
    rows, columns = grid_shape(window, geometry.nodes, LEAST_NODES)
    uv = window_uv(window, rows, columns)
    seen = profile(volume, chart, uv, start.subject_opacity)
    opacity = seen.opacity.astype(np.float64)
    if surface is None or vertices is None:
        known, kept = seen.radius, np.zeros((rows, columns))
        source = fact("middle_from_volume")
    else:
        mesh = mesh_radii(vertices, surface[1], chart, uv)
        share = seen_by(cameras, chart.points(uv, mesh).reshape(-1, 3)).reshape(mesh.shape) / len(cameras)
        unseen = (share < MIN_VIEW_SHARE) & np.isfinite(mesh)
        seen = replace(seen, radius=np.where(unseen, np.nan, seen.radius))
        known, kept = blend(mesh, seen.radius, np.where(share < WELL_SEEN, FAR, REACH))
        opacity = np.where(np.isfinite(mesh) & np.isnan(seen.radius), np.maximum(opacity, OPACITY), opacity)
        source = fact("middle_from_mesh", reach=REACH)
    middle = extrapolate(known).clip(MIN_RADIUS)
    least, most = halfwidths(geometry, pixel_size(scene))
    frames = [seen.radius]
    for splats in others:
        radii = profile(volume_in(scene, splats), chart, uv, start.subject_opacity).radius
        frames.append(np.where(np.isnan(seen.radius), np.nan, radii))
    surfaces = [middle, *(np.where(np.isnan(radii), middle, radii) for radii in frames)]
    own, *theirs = offsets(chart, window, surfaces, max(geometry.rounds) * most, volume.voxel)
    widths = spread(seen, own, least, most, volume.voxel)
    mean, reach = over_frames(own, list(zip(frames, theirs, strict=True)), widths)
    mean = mean.through(middle, own.radius(np.zeros_like(middle)), 2 * volume.voxel)
    radius = float(np.quantile(middle[opacity >= start.subject_opacity], RADIUS_QUANTILE))
    texels = texel_count(scene, window, radius, params.textures.pixels_per_texel)
    second = second_surface(volume, chart, window, mean.radius(-widths - reach), cameras)
    return Fit(
        chart=chart,
        window=window,
        offsets=mean,
        halfwidth=widths,
        reach=reach,
        second=second,
        trust=TRUST * kept + reach,
        rgb=seen.rgb.astype(np.float64),
        texels=texels,
        reasons=(*_reasons(params, losses[chart], source, (least, most), second), *notes),
        notes=notes,
        volume=volume,
        losses=losses,
        start_psnr=subject.psnr,
        torso=subject.torso,
    )


def volume_in(scene: Scene, splats: Splats, cells: int = CELLS) -> Volume:
    """Of the subject in a frame, as fine as the pictures show it."""
    return volume_of(splats, cells, FINEST * pixel_size(scene))


def _reasons(
    params: ExplicitParams, lost: float, middle: Fact, widths: tuple[float, float], second: Array
) -> tuple[Fact, ...]:
    """One a choice."""
    start, (least, most) = params.start, widths
    return (
        fact("centre_chosen", tie=start.centre_tie, lost=lost),
        fact("window_chosen", opacity=start.subject_opacity, margin=WINDOW_MARGIN),
        middle,
        fact("halfwidth_chosen", least=least, most=most),
        *([fact("second_surface", layers=LAYERS, share=float((second > 0).mean()))] if second.any() else []),
        fact("texels_chosen", pixels=params.textures.pixels_per_texel),
    )


def filmed_around(cameras: Sequence[Camera]) -> bool:
    """Whether the widest gap between their azimuths is 60 degrees (`ROUND`) at most."""
    view = filmed_view(cameras)
    return view is not None and view.azimuth[1] - view.azimuth[0] >= ROUND


def fit_window(
    volume: Volume, chart: Chart, points: Array, vertices: Array | None, params: StartParams, around: bool = False
) -> Window:
    """Box around the directions that hold the subject: the volume's near `points` that cameras see, (P, 3), and those
    of mesh vertices (K, V, 3) in front of the axis: a mesh has a back that nobody may have filmed.

    Args:
        around: the cameras stand all around; else it ends behind the ears and before the crown.

    Raises:
        UserError: if there is nothing.
    """
    limits = whole_window(chart, params, around)
    uv, least = window_uv(limits, WINDOW_NODES, WINDOW_NODES), params.subject_opacity
    last = WINDOW_NODES - 1
    highest, lowest = np.array([limits[1], limits[3]]), np.array([limits[0], limits[2]])
    nodes = np.rint((chart.uv(points)[0] - lowest) / (highest - lowest) * last).astype(int)
    nodes = nodes[((nodes >= 0) & (nodes <= last)).all(1)]
    seen = np.zeros((WINDOW_NODES, WINDOW_NODES), bool)
    seen[last - nodes[:, 0], nodes[:, 1]] = True
    near = ndimage.binary_dilation(seen, iterations=NEAR_NODES)
    subject = near & (profile(volume, chart, uv, least).opacity >= least)
    held = [uv[large(subject, math.ceil(LEAST_PATCH * subject.sum()))]]
    if vertices is not None:
        places, _ = chart.uv(some_frames(vertices).reshape(-1, 3))
        held.append(places[((places >= lowest) & (places <= highest)).all(1) & (np.abs(places[:, 1]) <= 1)])
    places, margin = np.concatenate(held), WINDOW_MARGIN
    if not len(places):
        raise UserError(
            "nothing of what the cameras see has a place on the layers",
            place="the starting volume",
            expected="a subject around the origin",
            found="one that lies elsewhere",
            remedy="check `front` and `centre` of the subject (`facefolds doctor`), or add to train.start.centres",
        )
    low, high = np.maximum(places.min(0) - margin, lowest), np.minimum(places.max(0) + margin, highest)
    return closed((float(low[0]), float(high[0]), float(low[1]), float(high[1])))


def halfwidths(params: GeometryParams, pixel: float) -> tuple[float, float]:
    """The least and the greatest, units; `pixel`: of the median camera at the subject, units."""
    least = max(params.halfwidth, min(params.max_halfwidth, HALFWIDTH_PIXELS[0] * pixel))
    return least, max(least, min(params.max_halfwidth, HALFWIDTH_PIXELS[1] * pixel))


WIDTH_BLUR = 4.0
"""Smoothing of the halfwidths, standard deviation, nodes: the spread found is noisy, and layers must not be."""


def spread(seen: Profile, offsets: Offsets, least: float, most: float, voxel: float) -> Array:
    """Halfwidths: the least one, plus half of the spread of the volume's opacity beyond the three voxels that a sharp
    surface has in it, plus the distance of the surface from the volume's beyond a voxel; smoothed."""
    outer, inner, middle = (offsets.distance(radii) for radii in (seen.outer, seen.inner, seen.radius))
    thick = np.nan_to_num(0.5 * np.clip(outer - inner - 3 * voxel, 0, None))
    off = np.nan_to_num(np.clip(np.abs(middle) - voxel, 0, None))
    wide: Array = ndimage.gaussian_filter(least + thick + off, WIDTH_BLUR, mode="nearest").clip(least, most)
    return wide


FILL_BLURS = (32, 16, 8, 4, 2, 1)
"""Standard deviations, nodes, from coarse to fine: the first bridges the widest gaps of a map of 384 nodes, the last
leaves no crease at a gap's border."""
FILL_ROUNDS = 8
"""Of each of them, the known values put back after each."""


def extrapolate(radii: Array) -> Array:
    """Fill NaN: the nearest known value, relaxed from coarse to fine with the known ones held."""
    missing = np.isnan(radii)
    if not missing.any():
        return radii
    nearest = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    filled: Array = radii[tuple(nearest)]
    for sigma in FILL_BLURS:
        for _ in range(FILL_ROUNDS):
            filled = np.where(missing, ndimage.gaussian_filter(filled, sigma, mode="nearest"), radii)
    return filled


def texel_count(scene: Scene, window: Window, radius: float, pixels_per_texel: float) -> tuple[int, int]:
    """(H, W), multiples of 16: a texel at `radius` from c is so many pixels of the median training camera."""
    texel = pixels_per_texel * pixel_size(scene)
    height = (window[1] - window[0]) * math.pi / 2 * radius / texel
    width = (window[3] - window[2]) * math.pi / 2 * radius / texel
    return max(32, 16 * round(height / 16)), max(32, 16 * round(width / 16))


def pixel_size(scene: Scene) -> float:
    """Of the median training camera at the origin, units."""
    cameras = [scene.cameras[i] for i in scene.indices("train")]
    return float(np.median([np.linalg.norm(c.centre) / c.K[0, 0] for c in cameras]))


RECENTRE_SCALES = (16.0, 4.0, 1.0)
"""Smoothings from coarse to fine, times `blur`: a direction with nothing opaque follows what lies far away."""
ENOUGH_OPACITY = 0.1
"""Opacity that a scale must hold near a node to decide alone, a tenth of a layer's; with less the coarser one does in
proportion."""


def recentre(distances: Array, alpha: NDArray[np.float32], blur: float) -> Array:
    """How far the layers should move outwards to lie around the opacity found.

    With w_i = alpha_i prod_{k<i} (1 - alpha_k), the offset of a node is sum_i w_i (d_i - middle) / sum_i w_i. It is
    smoothed with sum_i w_i as the weight, so that transparent directions follow their neighbours and detail of the
    start finer than `blur` is kept.

    Args:
        distances: (rows, columns, N) of the layers from the surface, falling, units.
        alpha: (rows, columns, N) opacity at the same nodes.
        blur: standard deviation of the smoothing, nodes.

    Returns:
        (rows, columns) to be added to the distances, units.
    """
    weights = (alpha * transmittance_before(alpha, -1)).astype(np.float64)
    mass = weights.sum(-1)
    middle = 0.5 * (distances[..., 0] + distances[..., -1])
    moment = (weights * (distances - middle[..., None])).sum(-1)
    moved = np.zeros_like(middle)
    for scale in RECENTRE_SCALES:
        near = ndimage.gaussian_filter(mass, scale * blur, mode="nearest")
        found = ndimage.gaussian_filter(moment, scale * blur, mode="nearest") / np.maximum(near, 1e-9)
        trust = np.clip(near / ENOUGH_OPACITY, 0, 1)
        moved = trust * found + (1 - trust) * moved
    return moved
