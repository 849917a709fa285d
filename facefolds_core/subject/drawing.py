"""Pictures of Gaussians, and what a change of each pixel asks of each Gaussian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.blend_kernel import TILE, blend, list_entries, unblend
from facefolds_core.subject.project_kernel import FLAT, PLANE, project, unproject
from facefolds_core.subject.splats import COLUMNS, Splats

Array = NDArray[np.float32]


@dataclass(frozen=True)
class SplatCamera:
    """A camera as the kernels take it.

    Attributes:
        matrix: (6, 3) float64, see `project`.
        centre: (3,) float64.
        size: (width, height).
        tiles: how many tiles the picture has across and down.
    """

    matrix: NDArray[np.float64]
    centre: NDArray[np.float64]
    size: tuple[int, int]
    tiles: tuple[int, int]

    @property
    def padded(self) -> tuple[int, int]:
        """(H, W) of whole tiles."""
        return self.tiles[1] * TILE[1], self.tiles[0] * TILE[0]


def view_of(camera: Camera) -> SplatCamera:
    """A camera for the kernels."""
    K = camera.K
    rows = [*camera.rotation, camera.w2c[:, 3], [K[0, 0], K[1, 1], K[0, 1]], [K[0, 2], K[1, 2], 0.0]]
    size = camera.width, camera.height
    return SplatCamera(
        np.array(rows, np.float64), camera.centre, size, (-(-size[0] // TILE[0]), -(-size[1] // TILE[1]))
    )


@dataclass(frozen=True)
class Drawing:
    """A picture of Gaussians with what its gradient needs.

    Attributes:
        view: of which camera.
        plane: (N, PLANE), see project_kernel.py.
        colours: (N, 3) with which it was blended.
        first, listed, starts: of `list_entries`.
        rgb: (3, H, W) float32 over black, of whole tiles.
        light: (H, W) float32 transmittance, of whole tiles.
    """

    view: SplatCamera
    plane: Array
    colours: Array
    first: NDArray[np.int64]
    listed: NDArray[np.int32]
    starts: NDArray[np.int64]
    rgb: Array
    light: Array

    def blended(self, colours: Array) -> Drawing:
        """The same Gaussians in other colours, (N, 3) float32."""
        colours = np.ascontiguousarray(colours, np.float32)
        rgb, light = np.empty_like(self.rgb), np.empty_like(self.light)
        blend(self.plane, colours, self.listed, self.starts, self.view.tiles[0], rgb, light)
        return Drawing(self.view, self.plane, colours, self.first, self.listed, self.starts, rgb, light)

    def picture(self) -> tuple[Array, Array]:
        """Colours over black (h, w, 3) and transmittance (h, w), without what the tiles have more."""
        width, height = self.view.size
        return np.moveaxis(self.rgb[:, :height, :width], 0, -1), self.light[:height, :width]


def draw(values: Array, view: SplatCamera) -> Drawing:
    """Draw Gaussians (N, COLUMNS)."""
    count, (across, down) = len(values), view.tiles
    plane, tiles = np.zeros((count, PLANE), np.float32), np.empty((count, 4), np.int32)
    project(values, view.matrix, view.centre, view.size, TILE, plane, tiles)
    seen = np.flatnonzero((tiles[:, 1] > tiles[:, 0]) & (tiles[:, 3] > tiles[:, 2]))
    order = seen[np.argsort(plane[seen, 9], kind="stable")]
    first, starts = np.empty(count + 1, np.int64), np.empty(across * down + 1, np.int64)
    listed = list_entries(tiles, order, across, down, first, starts)
    height, width = view.padded
    rgb, light = np.empty((3, height, width), np.float32), np.empty((height, width), np.float32)
    colours = np.ascontiguousarray(plane[:, 6:9])
    blend(plane, colours, listed, starts, across, rgb, light)
    return Drawing(view, plane, colours, first, listed, starts, rgb, light)


def differentiate(values: Array, drawing: Drawing, wish: Array, wish_light: Array) -> tuple[Array, Array]:
    """The loss's derivatives by the Gaussians.

    Args:
        wish: (3, H, W) float32, derivative by `drawing.rgb`.
        wish_light: (H, W) float32, derivative by `drawing.light`.

    Returns:
        (N, COLUMNS), and `moved` (N,) of `unproject`.
    """
    view, count = drawing.view, len(values)
    rest = (drawing.rgb * wish).sum(0) + drawing.light * wish_light
    flat = np.empty((int(drawing.first[-1]), FLAT), np.float32)
    unblend(drawing.plane, drawing.colours, drawing.listed, drawing.starts, view.tiles[0], wish, rest, flat)
    gradient, moved = np.empty((count, COLUMNS), np.float32), np.empty(count, np.float32)
    unproject(values, view.matrix, view.centre, view.size, drawing.plane, drawing.first, flat, gradient, moved)
    return gradient, moved


def render(splats: Splats, camera: Camera) -> tuple[Array, Array, Array]:
    """A picture.

    Returns:
        RGB (H, W, 3) over the background, opacity (H, W), and mean depth along the optical axis (H, W) of what is
        seen, units, 0 where there is nothing.
    """
    drawing = draw(splats.values, view_of(camera))
    rgb, light = drawing.picture()
    depths = np.repeat(drawing.plane[:, 9:10], 3, 1)
    sums = drawing.blended(depths).picture()[0][..., 0]
    alpha = 1 - light
    rgb = np.asarray(rgb + light[..., None] * splats.background)
    return rgb, np.asarray(alpha), np.asarray(sums / np.maximum(alpha, np.float32(1e-6)))
