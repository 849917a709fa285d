"""Where (u, v) and a radius lie in space: on rays from a centre; below a belt, on rays from an axis.

The paper's map (`sphere_uv`) sends rays from one point c. A head on a neck on a collar is not star-shaped around any
point: from within the head the collar's outer edge hides its top, and a sheet with one radius a direction can hold only
one of them. So a chart may have a *belt*: at elevations above -e it is the sphere's; below, the elevation of the rays
stays -e, and their origin slides down the vertical axis through c instead, by `girth` a radian of u. The two agree on
the cone between them, where the map is continuous. With p - c = (x, y, z), h = |(x, y)|, and z < -h tan e:
u = -2/pi (e + (-z - h tan e) / girth), v = 2/pi atan2(y, x), radius = h / cos e.

v is the azimuth / 90 degrees and may go beyond [-1, 1] (behind the ears), up to +-2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.sphere_uv import library_of, points_to_uv, uv_to_directions

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
    """

    centre: tuple[float, float, float]
    belt: Belt | None = None

    def __str__(self) -> str:
        return f"{self.centre[0]:.2f}" + ("" if self.belt is None else f" belt {self.belt.degrees:g}")

    def uv(self, points: Any) -> tuple[Any, Any]:
        """Points (..., 3), of numpy or torch -> (u, v) (..., 2) and radius (...)."""
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
        if self.belt is None:
            return uv_to_directions(uv)
        lib = library_of(uv)
        return uv_to_directions(lib.stack([lib.clip(uv[..., 0], self.lowest, None), uv[..., 1]], -1))

    def origins(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> where the rays begin (..., 3): c, or below it."""
        zero = uv[..., 0] * 0
        x, y, z = self.centre
        down = zero if self.belt is None else self._fall(uv, self.belt) * self.belt.girth
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
        return library_of(uv).stack([x, y, z - self._fall(uv, self.belt)], -1)

    def below(self, uv: Any) -> Any:
        """(u, v) (..., 2) -> (...) bool: below the belt."""
        return uv[..., 0] < self.lowest

    @property
    def lowest(self) -> float:
        """u of the belt, -inf without one."""
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

    @staticmethod
    def _fall(uv: Any, belt: Belt) -> Any:
        """(u, v) (..., 2) -> (...) radians of u below the belt, 0 above it."""
        return library_of(uv).clip(-uv[..., 0] * _TO_ANGLE - belt.elevation, 0, None)
