"""A map of a window onto itself that gives each place the room that it is to have (a density-equalising map).

J. Moser, "On the volume elements on a manifold", 1965: of a density rho with mean 1 and a potential whose Laplacian is
rho - 1, points that flow along grad(potential) / ((1 - t) rho + t) from t = 0 to 1 end where it is 1 everywhere.
A border stays a border; a window that goes all around is periodic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from facefolds_core.geometry.sphere_uv import ALL_AROUND, Window, library_of, window_uv

Array = NDArray[np.float64]

STEPS = 48
"""Of the flow: areas are then right within 2 % where densities differ by a factor of 9."""

ROUNDED = 1e-6
"""By so much a border that was stored in single precision may lie outside."""


@dataclass(frozen=True, eq=False)
class Warp:
    """The map at the nodes of a grid over a window, bilinear between them.

    Attributes:
        window: (u0, u1, v0, v1).
        forth: (rows, columns, 2) (u, v) to which the nodes go, from u1 to u0 and from v0 to v1.
        back: (rows, columns, 2) from which something comes to the nodes.
    """

    window: Window
    forth: Array
    back: Array

    @property
    def sound(self) -> bool:
        """Whether all of it lies in the window: what a file says may be anything."""
        u0, u1, v0, v1 = self.window
        aside = ALL_AROUND if self.around else 0.0  # v of a map that is periodic may go on beyond a border
        least, most = np.array([u0, v0 - aside]) - ROUNDED, np.array([u1, v1 + aside]) + ROUNDED
        grids = np.stack([self.forth, self.back])
        return min(grids.shape[1:3]) >= 2 and bool(((grids >= least) & (grids <= most)).all())

    @property
    def around(self) -> bool:
        return self.window[3] - self.window[2] >= ALL_AROUND

    def apply(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> where they go; outside the window as far as the nearest place in it goes."""
        return self._wrapped(self._moved(self.forth, uv))

    def undo(self, uv: Any) -> Any:
        """The inverse of `apply`."""
        return self._wrapped(self._moved(self.back, uv))

    def before(self, rows: int, columns: int) -> Array:
        """(rows, columns, 2) where the nodes of a grid over the window come from; v is continuous across a border."""
        return np.asarray(self._moved(self.back, window_uv(self.window, rows, columns)))

    def _moved(self, grid: Array, uv: Any) -> Any:
        lib = library_of(uv)
        u0, u1, v0, v1 = self.window
        rows, columns = grid.shape[:2]
        values = grid if lib is np else uv.new_tensor(grid)
        y = lib.clip((u1 - uv[..., 0]) / (u1 - u0) * (rows - 1), 0, rows - 1)
        x = lib.clip((uv[..., 1] - v0) / (v1 - v0) * (columns - 1), 0, columns - 1)
        i, j = (self._whole(part, n - 2) for part, n in ((y, rows), (x, columns)))
        a, b = (y - i)[..., None], (x - j)[..., None]
        top = values[i, j] * (1 - b) + values[i, j + 1] * b
        bottom = values[i + 1, j] * (1 - b) + values[i + 1, j + 1] * b
        nearest = lib.stack([u1 - y * ((u1 - u0) / (rows - 1)), v0 + x * ((v1 - v0) / (columns - 1))], -1)
        return top * (1 - a) + bottom * a + (uv - nearest)

    @staticmethod
    def _whole(place: Any, most: int) -> Any:
        if library_of(place) is np:
            return np.minimum(np.asarray(place).astype(np.intp), most)
        return place.long().clamp(max=most)

    def _wrapped(self, uv: Any) -> Any:
        if not self.around:
            return uv
        lib, v, half = library_of(uv), uv[..., 1], ALL_AROUND / 2
        v = lib.where(v > half, v - ALL_AROUND, lib.where(v < -half, v + ALL_AROUND, v))
        return lib.stack([uv[..., 0], v], -1)


def evened(density: Array, window: Window) -> Warp:
    """The map after which a density is even: each place gets room in proportion to it.

    Args:
        density: (rows, columns) > 0 at the nodes over the window; of one that goes all around both borders are alike.
    """
    rows, columns = density.shape
    u0, u1, v0, v1 = window
    around = v1 - v0 >= ALL_AROUND
    sides = (u1 - u0) / (rows - 1), (v1 - v0) / (columns - 1)
    rho = density / np.average(density, weights=np.outer(_trapezoid(rows), _trapezoid(columns)))
    down, right = _gradient(_potential(rho, sides, around), around)
    fields = down / sides[0] ** 2, right / sides[1] ** 2, rho
    start = np.indices(density.shape).astype(np.float64)
    last = np.array([rows - 1, columns - 1]).reshape(2, 1, 1)

    def speed(at: Array, t: float) -> Array:
        places = np.stack([at[0], at[1] % (columns - 1)]) if around else at
        y, x, there = (ndimage.map_coordinates(field, places, order=1, mode="nearest") for field in fields)
        return np.asarray(np.stack([y, x]) / ((1 - t) * there + t))

    def flown(begin: float, end: float) -> Array:
        at, step = start, (end - begin) / STEPS
        for t in begin + step * np.arange(STEPS):
            middle = at + 0.5 * step * speed(at, t)
            at = at + step * speed(middle, t + 0.5 * step)
            inside = at.clip(0, last)
            at = np.stack([inside[0], at[1]]) if around else inside
        return np.stack([u1 - at[0] * sides[0], v0 + at[1] * sides[1]], -1)

    return Warp(window, flown(0.0, 1.0), flown(1.0, 0.0))


def _trapezoid(count: int) -> Array:
    weights = np.ones(count)
    weights[[0, -1]] = 0.5
    return weights


def _potential(rho: Array, sides: tuple[float, float], around: bool) -> Array:
    """(rows, columns) whose Laplacian is rho - 1 and whose slope across borders is 0: by cosine transforms, and around
    by Fourier's."""
    rows, columns = rho.shape
    own = fft.dct(rho[:, : columns - around] - 1, 1, axis=0)
    own = fft.fft(own, axis=1) if around else fft.dct(own, 1, axis=1)
    down = np.pi * np.arange(rows) / (rows - 1)
    right = (2 if around else 1) * np.pi * np.arange(own.shape[1]) / (columns - 1)
    factors = [(2 * np.cos(angle) - 2) / side**2 for angle, side in zip((down, right), sides, strict=True)]
    eigenvalues = factors[0][:, None] + factors[1]
    eigenvalues[0, 0] = 1  # the mean, which is free
    own = own / eigenvalues
    own[0, 0] = 0
    own = fft.ifft(own, axis=1).real if around else fft.idct(own, 1, axis=1)
    found = fft.idct(own, 1, axis=0)
    return np.concatenate([found, found[:, :1]], 1) if around else found


def _gradient(potential: Array, around: bool) -> tuple[Array, Array]:
    """Of a step down and one to the right; 0 across borders."""
    down, right = (np.asarray(part) for part in np.gradient(potential))
    down[[0, -1]] = 0
    right[:, [0, -1]] = 0.5 * (potential[:, 1] - potential[:, -2])[:, None] if around else 0
    return down, right
