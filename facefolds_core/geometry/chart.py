"""Where (u, v) and a radius lie in space: on rays from a centre; below a belt, on rays from an axis.

The paper's map (`sphere_uv`) sends rays from one point c. A head on a neck on a collar is not star-shaped around any
point: from within the head the collar's outer edge hides its top, and a sheet with one radius a direction can hold only
one of them. So a chart may have a *belt*: at elevations above -e it is the sphere's; below, the elevation of the rays
stays -e, and their origin slides down the vertical axis through c instead, by `girth` a radian of u. The two agree on
the cone between them, where the map is continuous. With p - c = (x, y, z), h = |(x, y)|, and z < -h tan e:
u = -2/pi (e + (-z - h tan e) / girth), v = 2/pi atan2(y, x), radius = h / cos e.

v is the azimuth / 90 degrees and may go beyond [-1, 1] (behind the ears), up to +-2.

A chart may be warped: these are then the *angles*, and (u, v) is where a warp takes them, so that a texture can have
its texels where the surface is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.sphere_uv import library_of, points_to_uv, uv_to_directions
from facefolds_core.geometry.warp import Warp

_TO_ANGLE = math.pi / 2


@dataclass(frozen=True)
class Belt:
    """Where the sphere ends, and how fast rays slide down below.

    Attributes:
        elevation: e, radians, from 0 (level) to below pi / 2: of the rays below, downwards.
        girth: units by which the origin slides for a radian of u.
    """

    elevation: float
    girth: float

    BOUNDS: ClassVar[str] = "with an elevation from 0 to 1.5 and a girth from 0.001 to 10"

    @property
    def sound(self) -> bool:
        """Whether both lie within `BOUNDS`: what a file says may be anything."""
        return 0 <= self.elevation <= 1.5 and 1e-3 <= self.girth <= 10

    @property
    def degrees(self) -> float:
        return round(math.degrees(self.elevation), 3)


@dataclass(frozen=True)
class Chart:
    """The map between points of space and (u, v) with a radius.

    Attributes:
        centre: c, units.
        belt: None for the paper's map, the sphere alone.
        warp: from angles to (u, v); None where they are the same.
    """

    centre: tuple[float, float, float]
    belt: Belt | None = None
    warp: Warp | None = None

    def __str__(self) -> str:
        return f"{self.centre[0]:.2f}" + ("" if self.belt is None else f" belt {self.belt.degrees:g}")

    def uv(self, points: Any) -> tuple[Any, Any]:
        """Points (..., 3), of numpy or torch -> (u, v) (..., 2) and radius (...)."""
        angles, radius = self._angles_of(points)
        return angles if self.warp is None else self.warp.apply(angles), radius

    def angles(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> those of the chart without its warp (..., 2)."""
        return uv if self.warp is None else self.warp.undo(uv)

    def _angles_of(self, points: Any) -> tuple[Any, Any]:
        lib = library_of(points)
        centre = np.array(self.centre) if lib is np else points.new_tensor(self.centre)
        uv, radius = points_to_uv(points, centre)
        if self.belt is None:
            return uv, radius
        offset = points - centre
        x, y, z = (offset[..., k] for k in range(3))
        flat = lib.sqrt(x**2 + y**2)  # distance from the axis
        slide = -z - flat * math.tan(self.belt.elevation)  # of the ray's origin
        below = slide > 0
        u = -(self.belt.elevation + slide / self.belt.girth) / _TO_ANGLE
        uv = lib.stack([lib.where(below, u, uv[..., 0]), uv[..., 1]], -1)
        return uv, lib.where(below, flat / math.cos(self.belt.elevation), radius)

    def directions(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> unit directions (..., 3) of the rays, outwards."""
        angles = self.angles(uv)
        if self.belt is None:
            return uv_to_directions(angles)
        lib = library_of(angles)
        return uv_to_directions(lib.stack([lib.clip(angles[..., 0], self.lowest, None), angles[..., 1]], -1))

    def origins(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> where the rays begin (..., 3): c, or below it."""
        zero = uv[..., 0] * 0
        x, y, z = self.centre
        down = zero if self.belt is None else self._fall(self.angles(uv), self.belt) * self.belt.girth
        return library_of(uv).stack([zero + x, zero + y, z - down], -1)

    def points(self, uv: Any, radius: Any) -> Any:
        """(u, v) (..., 2) and radius (...) -> points (..., 3). The inverse of `uv`."""
        return self.origins(uv) + radius[..., None] * self.directions(uv)

    def unrolled(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> vectors (..., 3) that are the directions above the belt and go on falling below it, where
        those are all alike: a triangle in (u, v) keeps its side as long as the determinant of its three is positive."""
        directions = self.directions(uv)
        if self.belt is None:
            return directions
        x, y, z = (directions[..., k] for k in range(3))
        return library_of(uv).stack([x, y, z - self._fall(self.angles(uv), self.belt)], -1)

    def below(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> (...) bool: below the belt."""
        return self.angles(uv)[..., 0] < self.lowest

    @property
    def lowest(self) -> float:
        """Angle u of the belt, -inf without one."""
        return -math.inf if self.belt is None else -self.belt.elevation / _TO_ANGLE

    def outward(self, points: Any) -> Any:
        """Points (..., 3) -> unit directions (..., 3) of the rays through them."""
        return self.directions(self.uv(points)[0])

    @cached_property
    def numbers(self) -> NDArray[np.float64]:
        """(4,) e, tan e, 1 / cos e, 1 / girth, as kernels take them; without a belt nothing lies below."""
        if self.belt is None:
            return np.array([math.pi / 2, math.inf, 1.0, 1.0])
        e = self.belt.elevation
        return np.array([e, math.tan(e), 1 / math.cos(e), 1 / self.belt.girth])

    @cached_property
    def warped(self) -> NDArray[np.float64]:
        """(rows, columns, 2) shares of the window's height, from above, and of its width, from the left, to which the
        warp takes the nodes of a grid over it, as kernels take them; (0, 0, 2) without one."""
        if self.warp is None:
            return np.zeros((0, 0, 2))
        u0, u1, v0, v1 = self.warp.window
        return np.asarray((self.warp.forth - np.array([u1, v0])) / np.array([u0 - u1, v1 - v0]))

    @staticmethod
    def _fall(angles: Any, belt: Belt) -> Any:
        """Angles (..., 2) -> (...) radians of u below the belt, 0 above it."""
        return library_of(angles).clip(-angles[..., 0] * _TO_ANGLE - belt.elevation, 0, None)
