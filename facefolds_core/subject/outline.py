"""What a volume says about layers over a chart: where they lie on each of its rays, how opaque they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.params import StartParams
from facefolds_core.subject import look_kernel
from facefolds_core.subject.found import no_subject
from facefolds_core.subject.volume import Volume

Array = NDArray[np.float64]
Bool = NDArray[np.bool_]

MIN_RADIUS = 0.03
"""Least radius of a layer's middle, units: at c the search for crossings ends."""
REACHED = (0.5, 0.1, 0.9)
"""Shares of a direction's opacity at which its surface lies, begins and ends: halves are least moved by a blur."""
BEYOND = 3.0
"""Voxels: a surface between two voxels is blurred by so much."""


@dataclass(frozen=True)
class Profile:
    """The volume along the rays of a chart.

    Attributes:
        radius: (...) where half of the opacity is reached from outside; NaN where there is too little of it, units.
        outer, inner: (...) where a tenth and nine tenths of it are reached (`REACHED`), units.
        opacity: (...) along the whole direction, float32.
        rgb: (..., 3) colour, composited from outside and divided by the opacity, float32.
    """

    radius: Array
    outer: Array
    inner: Array
    opacity: NDArray[np.float32]
    rgb: NDArray[np.float32]


def profile(volume: Volume, chart: Chart, uv: Array, least: float) -> Profile:
    """Integrate the volume from outside inwards along the chart's rays of (u, v) (..., 2).

    Args:
        least: opacity of a direction from which on it has radii.
    """
    size = np.array(volume.grid.shape[:3]) - 1
    ends = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners = volume.lower + volume.voxel * ends * size
    origins, directions = (np.ascontiguousarray(of(uv).reshape(-1, 3)) for of in (chart.origins, chart.directions))
    farthest = max(float(np.linalg.norm(corner - origins, axis=1).max()) for corner in corners)
    opacity, rgb, radii = look_kernel.profile(
        volume.grid,
        volume.lower,
        volume.voxel,
        origins,
        directions,
        farthest,
        0.5 * volume.voxel,
        np.array(REACHED),
    )
    radii = np.where(opacity[:, None] >= least, radii, np.nan).astype(np.float64)
    rgb /= np.maximum(opacity, look_kernel.CLEAR)[:, None]
    shape = uv.shape[:-1]
    middle, outer, inner = (radii[:, k].reshape(shape) for k in range(3))
    return Profile(middle, outer, inner, opacity.reshape(shape), rgb.reshape(*shape, 3))


def shells(volume: Volume, chart: Chart, uv: Array, radii: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """What the volume puts on each of N layers.

    Args:
        uv: (..., 2).
        radii: (..., N) of the layers there, outermost first, units.

    Returns:
        opacity (..., N) and rgb (..., N, 3): composited over one another the layers show what the volume shows, seen
        along the chart's rays. What lies farther than `BEYOND` voxels outside of all of them or behind is left out.
    """
    rays = (np.ascontiguousarray(of(uv).reshape(-1, 3)) for of in (chart.origins, chart.directions))
    flat = np.ascontiguousarray(radii.reshape(-1, radii.shape[-1]), np.float64)
    step, beyond = 0.5 * volume.voxel, BEYOND * volume.voxel
    found = look_kernel.shells(volume.grid, volume.lower, volume.voxel, *rays, flat, step, beyond)
    return -np.expm1(-found[..., 0]).reshape(radii.shape), found[..., 1:].reshape(*radii.shape, 3)


def grid_shape(window: Window, longest: int, least: int) -> tuple[int, int]:
    """Rows and columns, at least so many, of a grid over a window whose cells are as wide as high."""
    u0, u1, v0, v1 = window
    scale = longest / max(u1 - u0, v1 - v0)
    return max(least, round(scale * (u1 - u0))), max(least, round(scale * (v1 - v0)))


def node_positions(uv: Array, window: Window, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """(u, v) (..., 2) -> rows and columns (...), continuous, of a grid (rows, columns) as of `window_uv`."""
    u0, u1, v0, v1 = window
    return (u1 - uv[..., 0]) / (u1 - u0) * (shape[0] - 1), (uv[..., 1] - v0) / (v1 - v0) * (shape[1] - 1)


def nodes_at(uv: Array, window: Window, shape: tuple[int, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp], Bool]:
    """Rows (P,) and columns (P,) of the nodes, of a grid (rows, columns) as of `window_uv`, that are nearest to (u, v)
    (P, 2); and whether these lie within the window."""
    last = shape[0] - 1, shape[1] - 1
    i, j = node_positions(uv, window, shape)
    within = (i >= 0) & (i <= last[0]) & (j >= 0) & (j <= last[1])
    row, column = (np.rint(at).astype(np.intp).clip(0, most) for at, most in zip((i, j), last, strict=True))
    return row, column, np.asarray(within)


def window_uv(window: Window, rows: int, columns: int) -> Array:
    """(rows, columns, 2) of the nodes of a radius map: they include the window's borders."""
    u, v = np.linspace(window[1], window[0], rows), np.linspace(window[2], window[3], columns)
    return np.stack(np.meshgrid(u, v, indexing="ij"), -1)


def texel_middles(window: Window, rows: int, columns: int) -> Array:
    """(rows, columns, 2) of the middles of a texture's texels: `sphere_uv.texel_uv`, which rounds in another order."""
    u = window[1] + (window[0] - window[1]) * (np.arange(rows) + 0.5) / rows
    v = window[2] + (window[3] - window[2]) * (np.arange(columns) + 0.5) / columns
    return np.stack(np.meshgrid(u, v, indexing="ij"), -1)


def visible_points(volume: Volume, cameras: list[Camera], rays_per_camera: int = 2500) -> Array:
    """(P, 3) where training rays reach half transmittance: the surface that the cameras see."""
    points = []
    for camera in cameras:
        stride = max(1, math.ceil(math.sqrt(camera.width * camera.height / rays_per_camera)))
        x, y = np.meshgrid(
            np.arange(stride // 2, camera.width, stride) + 0.5, np.arange(stride // 2, camera.height, stride) + 0.5
        )
        origins, directions = camera.rays(np.stack([x, y], -1).reshape(-1, 2))
        origins = np.broadcast_to(origins, directions.shape)
        _, _, depth = volume.render(origins.astype(np.float32), directions.astype(np.float32))
        seen = depth > 0
        points.append(origins[seen] + depth[seen, None] * directions[seen])
    return np.concatenate(points)


def whole_window(chart: Chart, params: StartParams, around: bool = False) -> Window:
    """Of all (u, v) that a chart may hold: with a belt there is no lower pole.

    Args:
        around: the subject was filmed all around.
    """
    highest, aside = params.around_limits if around else (params.window_limit, params.azimuth_limit)
    lowest = highest if chart.belt is None else params.column_limit
    return -lowest, highest, -aside, aside


def lost(volume: Volume, chart: Chart, points: Array, params: StartParams, around: bool = False) -> Bool:
    """(P,) whether no sheet over the chart can hold a visible point.

    They lie behind it or at its rim, nearer to c than layers may, or beneath or above the outermost surface in their
    direction by more than two voxels and what the surface's slope explains.
    """
    uv, radius = chart.uv(points)
    u0, u1, v0, v1 = window = whole_window(chart, params, around)
    rows, columns = params.centre_nodes, max(2, round(params.centre_nodes * (v1 - v0) / (u1 - u0)))
    radii = profile(volume, chart, window_uv(window, rows, columns), params.subject_opacity).radius
    high = ndimage.maximum_filter(np.where(np.isnan(radii), -np.inf, radii), 3)
    low = ndimage.minimum_filter(np.where(np.isnan(radii), np.inf, radii), 3)
    i, j, within = nodes_at(uv, window, (rows, columns))
    margin = 2 * volume.voxel
    held = within & (radius <= high[i, j] + margin) & (radius >= np.maximum(low[i, j] - margin, MIN_RADIUS))
    return np.asarray(~held)


def choose_chart(
    volume: Volume, views: Sequence[Array], params: StartParams, around: bool = False
) -> tuple[Chart, dict[Chart, float]]:
    """The chart that loses (nearly) the smallest share of visible points, over all and in the worst view, and the
    shares of all candidates.

    Args:
        views: (P, 3) points of each camera.
        around: they see the subject from all around.

    Raises:
        UserError: if there are no points.
    """
    points, ends = np.concatenate(views), np.cumsum([len(one) for one in views])[:-1]
    if not len(points):
        raise no_subject("the middle frame")
    charts = [chart for x in params.centres for chart in _charts(x, points, params)]
    gone = {chart: lost(volume, chart, points, params, around) for chart in charts}
    losses = {chart: float(one.mean()) for chart, one in gone.items()}
    tied = [c for c, loss in losses.items() if loss <= min(losses.values()) + params.centre_tie]
    worst = {c: max(float(part.mean()) for part in np.split(gone[c], ends) if len(part)) for c in tied}
    kept = (c for c in tied if worst[c] <= min(worst.values()) + params.view_tie)
    return min(kept, key=lambda c: (c.centre[0], losses[c])), losses


def _charts(x: float, points: Array, params: StartParams) -> list[Chart]:
    """Around (x, 0, 0): the sphere, and one with each belt. A radian of u below it is as long as one of v around it."""
    centre = (x, 0.0, 0.0)
    girth = float(np.median(np.linalg.norm(points - np.array(centre), axis=1)))
    return [Chart(centre), *(Chart(centre, Belt(math.radians(belt), girth)) for belt in params.belts)]
