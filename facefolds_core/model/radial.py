"""Explicit surfaces: N nested radius maps over a window of (u, v). Layer i is {x : r(x) = rho_i(u(x), v(x))}.

(u, v) and r are those of a chart (`geometry/chart.py`); without a belt r = |x - c|."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.geometry.torso import Torso
from facefolds_core.model.intersection import Crossings, search_interval
from facefolds_core.model.radial_kernel import bounds, crossing_distances, heights, placed_points

STEP = 0.005
"""Distance between samples of the search, units: a twentieth of a nose."""

BISECTIONS = 25
"""Of `STEP`: what is left is less than float32 tells apart."""

MARGIN = 0.01
"""The search ball reaches this far beyond the largest radius, units."""


class RadialManifolds(nn.Module):
    """N nested radius maps: grids over the window whose nodes include its borders. Node (0, 0) is at (u1, v0), the top
    left corner as seen from the front, and values between nodes are bilinear. Outside the window there is no surface.
    Unlike the MLP's level sets a layer is met from either side: a ray may pass the window's edge and see it from
    behind, as it would see the exported mesh.

    Args:
        chart: where (u, v) and radii lie.
        window: (u0, u1, v0, v1).
        radii: [rows, columns, N], units, outermost first; 0 where a layer has no surface. Layers that have one at every
            node come first.
        torso: what of them stays in the room while the head turns.
    """

    centre: Tensor
    maps: Tensor

    def __init__(self, chart: Chart, window: Window, radii: Tensor, torso: Torso | None = None) -> None:
        super().__init__()
        self.chart, self.torso = chart, torso
        self.register_buffer("centre", torch.tensor(chart.centre, dtype=torch.float32))
        self.register_buffer("maps", radii.clone())
        self.window = window
        self._prepared: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None  # radii, their `bounds`, `heights`

    @property
    def num_layers(self) -> int:
        return self.maps.shape[-1]

    @property
    def radius(self) -> float:
        """Of a ball around c that holds all layers, units."""
        outermost = self.maps.amax(-1)
        if self.chart.belt is None:
            return float(outermost.max()) + MARGIN
        u0, u1, v0, v1 = self.window
        rows, columns = outermost.shape
        u, v = torch.linspace(u1, u0, rows), torch.linspace(v0, v1, columns)
        points = self.chart.points(torch.stack(torch.meshgrid(u, v, indexing="ij"), -1).to(outermost), outermost)
        return float((points - self.centre).norm(dim=-1).max()) + MARGIN

    def radii(self) -> Tensor:
        """[rows, columns, N], outermost first; NaN where a layer has no surface."""
        return torch.where(self.maps > 0, self.maps, torch.nan)

    def regularisation(self) -> Tensor:
        """0: they are trained by other means."""
        return self.maps.new_zeros(())

    def crossings(self, origins: Tensor, directions: Tensor, pose: Similarity | None = None) -> Crossings:
        """Rays [R, 3] -> nearest crossing with each layer, outermost first, without gradient. The compiled search on a
        CPU.

        Args:
            pose: of the head, which turns over a torso (head -> world); points are those of the layers as made.
        """
        bend = self.bend(pose)
        if bend is not None:
            return self._turned(origins, directions, bend)
        if origins.device.type != "cpu":
            return self.reference_crossings(origins, directions)
        offsets = (origins - self.centre).double().numpy()
        distance = torch.from_numpy(self.tracer()(offsets, directions.double().numpy(), None))
        points = origins[:, None] + distance[..., None] * directions[:, None]
        return Crossings(points, distance, distance > 0)

    def _turned(self, origins: Tensor, directions: Tensor, bend: np.ndarray) -> Crossings:
        """`crossings` while a torso stays in the room; points are those of the layers as they were made."""
        o, d = (part.cpu().double().numpy() for part in (origins, directions))
        offsets = o - self.centre.cpu().double().numpy()
        distance = self.tracer()(offsets, d, bend)
        there = offsets[:, None] + distance[..., None] * d[:, None]
        points = placed_points(there.reshape(-1, 3), bend).reshape(there.shape)
        found = torch.from_numpy(distance).to(origins)
        return Crossings(torch.from_numpy(points).to(origins) + self.centre, found, found > 0)

    def bend(self, pose: Similarity | None) -> np.ndarray | None:
        """How the compiled search finds layers while the head stands in a pose (head -> world); None without a torso.

        Returns:
            (18,) float64: n, d and w of the torso, R by rows and t of its shift D, all about c; how far anything goes.
        """
        if self.torso is None or pose is None:
            return None
        centre, normal, shift = self.centre.cpu().double().numpy(), np.array(self.torso.normal), self.torso.shift(pose)
        moved = shift.apply(centre) - centre
        farthest = float(np.linalg.norm(moved)) + self.radius * float(np.linalg.norm(shift.rotation - np.eye(3), 2))
        offset = self.torso.offset - normal @ centre
        return np.array([*normal, offset, self.torso.band, *shift.rotation.ravel(), *moved, farthest])

    def tracer(self) -> Callable[[np.ndarray, np.ndarray, np.ndarray | None], np.ndarray]:
        """A function, prepared for many calls, with the surfaces as they are now: (R, 3) float64 origins minus c,
        directions (R, 3) and a `bend` -> (R, N) float32 distances, 0 where missed."""
        rho = self.radii().cpu().numpy()
        window, belt, bound = np.array(self.window), self.chart.numbers, self.radius
        if self._prepared is None or not np.array_equal(self._prepared[0], rho, equal_nan=True):
            self._prepared = rho, bounds(rho), heights(rho, window, belt)
        _, cells, high = self._prepared
        whole = int(np.isfinite(rho).all((0, 1)).sum())

        def distances(offsets: np.ndarray, directions: np.ndarray, bend: np.ndarray | None) -> np.ndarray:
            offsets, directions = np.ascontiguousarray(offsets), np.ascontiguousarray(directions)
            found: np.ndarray = crossing_distances(
                offsets, directions, rho, window, belt, cells, high, whole, bound, STEP, bend
            )
            return found

        return distances

    def radii_at(self, uv: Tensor) -> tuple[Tensor, Tensor]:
        """Directions (u, v) [M, 2] -> rho [M, N], and whether they lie inside the window [M, N]."""
        y, x, inside = self._position(uv)
        n = self.radii().permute(2, 0, 1)[None]
        rows, columns = self.maps.shape[:2]
        at = torch.stack([x / (columns - 1), y / (rows - 1)], -1) * 2 - 1
        rho = torch.nn.functional.grid_sample(n, at[None, None].to(n), padding_mode="border", align_corners=True)
        rho = rho[0, :, 0].T
        return rho.nan_to_num(), inside[:, None] & rho.isfinite()

    def _position(self, uv: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Rows and columns (continuous) of directions (u, v) [..., 2], and whether they lie inside the window."""
        u0, u1, v0, v1 = self.window
        rows, columns = self.maps.shape[:2]
        y = (u1 - uv[..., 0]) / (u1 - u0) * (rows - 1)
        x = (uv[..., 1] - v0) / (v1 - v0) * (columns - 1)
        return y, x, (y >= 0) & (x >= 0) & (y <= rows - 1) & (x <= columns - 1)

    def reference_crossings(self, origins: Tensor, directions: Tensor) -> Crossings:
        """The same in torch."""
        distance, hit = self._search(self.radii(), origins, directions)
        return Crossings(origins[:, None] + distance[..., None] * directions[:, None], distance, hit)

    def _search(self, rho: Tensor, origins: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """First sign change between samples `STEP` apart at most, then `BISECTIONS`. [R, N] distance and hit."""
        front = self.window[2] >= -1 and self.window[3] <= 1
        near, far, valid = search_interval(origins, directions, self.centre, self.radius, front)
        samples = max(2, int(float((far - near).max()) / STEP) + 2)
        fraction = torch.linspace(0, 1, samples, dtype=near.dtype, device=near.device)
        s = near[:, None] + (far - near)[:, None] * fraction
        height, inside = self._heights(rho, origins[:, None] + s[..., None] * directions[:, None], all_layers=True)
        above = height >= 0
        there = height.isfinite()
        both = (inside[:, 1:] & inside[:, :-1] & valid[:, None])[..., None] & there[:, 1:] & there[:, :-1]
        hit, first = ((above[:, 1:] != above[:, :-1]) & both).max(1)
        a, b = s.gather(1, first), s.gather(1, first + 1)
        start = above.gather(1, first[:, None]).squeeze(1)
        for _ in range(BISECTIONS):
            m = 0.5 * (a + b)
            height, _ = self._heights(rho, origins[:, None] + m[..., None] * directions[:, None])
            same = (height >= 0) == start
            a, b = torch.where(same, m, a), torch.where(same, b, m)
        middle = 0.5 * (a + b)
        height, _ = self._heights(rho, origins[:, None] + middle[..., None] * directions[:, None])
        hit &= height.isfinite()  # not at the edge of a second surface
        return torch.where(hit, middle, 0.0), hit

    def _heights(self, rho: Tensor, points: Tensor, all_layers: bool = False) -> tuple[Tensor, Tensor]:
        """r - rho_i at points [R, S, 3], and whether they lie inside the window [R, S].

        With all_layers: [R, S, N]. Without: S = N, point (r, i) is compared with layer i, [R, N].
        """
        uv, r = self.chart.uv(points)
        y, x, inside = self._position(uv)
        rows, columns = self.maps.shape[:2]
        i = y.floor().clamp(0, rows - 2).long()
        j = x.floor().clamp(0, columns - 2).long()
        a, b = (y - i).clamp(0, 1), (x - j).clamp(0, 1)
        n = torch.arange(self.num_layers, device=points.device)

        def node(di: int, dj: int) -> Tensor:
            return rho[i + di, j + dj] if all_layers else rho[i + di, j + dj, n]

        if all_layers:
            a, b, r = a[..., None], b[..., None], r[..., None]
        found = (node(0, 0) * (1 - b) + node(0, 1) * b) * (1 - a) + (node(1, 0) * (1 - b) + node(1, 1) * b) * a
        return r - found, inside
