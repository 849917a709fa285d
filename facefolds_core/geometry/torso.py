"""What stays in the room while the head turns: shoulders. Layers are made in the head's own frame, where these move.

All that lies beyond a plane through the neck stays; along it points follow both, as by linear blend skinning with two
joints. With M_k the head's pose in frame k (head -> world) and M the one in which the layers were made, a point x of
theirs is in that frame, in the head's own frame, at

    y = x + s(x) (D_k x - x),    D_k = M_k^-1 M,    s(x) = (n.x - d) / w, from 0 to 1
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facefolds_core.geometry.quaternions import quaternion, rotation
from facefolds_core.geometry.similarity import Array, Similarity

NUMBERS = 12
"""Of `Torso.numbers`."""


@dataclass(frozen=True)
class Torso:
    """Attributes:
    normal: (3,) n, of unit length, from the head to the torso; in the head's own frame.
    offset: d, where points begin to stay, units.
    band: w > 0, within which they come to stay, units.
    quaternion, translation: (4,) w, x, y, z and (3,) of M.
    """

    normal: tuple[float, float, float]
    offset: float
    band: float
    quaternion: tuple[float, float, float, float]
    translation: tuple[float, float, float]

    @classmethod
    def at(cls, normal: ArrayLike, offset: float, band: float, pose: Similarity) -> Torso:
        """Of layers that were made while the head stood in a pose."""
        n, q, t = (np.asarray(one, float).tolist() for one in (normal, quaternion(pose.rotation), pose.translation))
        return cls(tuple(n), offset, band, tuple(q), tuple(t))

    @property
    def numbers(self) -> Array:
        """(12,) n, d, w, the quaternion, the translation."""
        return np.array([*self.normal, self.offset, self.band, *self.quaternion, *self.translation])

    @classmethod
    def of(cls, numbers: ArrayLike) -> Torso:
        """Of `numbers`."""
        n = np.asarray(numbers, float).tolist()
        return cls((n[0], n[1], n[2]), n[3], n[4], (n[5], n[6], n[7], n[8]), (n[9], n[10], n[11]))

    @property
    def sound(self) -> bool:
        """Whether the numbers are those of a torso."""
        lengths = np.linalg.norm(self.normal), np.linalg.norm(self.quaternion)
        return bool(np.isfinite(self.numbers).all() and self.band > 0 and np.allclose(lengths, 1, atol=1e-4))

    @property
    def rest(self) -> Similarity:
        """M."""
        return Similarity(1.0, rotation(np.array(self.quaternion)), np.array(self.translation))

    def share(self, points: NDArray[np.floating]) -> Array:
        """(...) s of points (..., 3), in [0, 1]."""
        along = np.asarray(points, np.float64) @ np.array(self.normal)
        return np.asarray(np.clip((along - self.offset) / self.band, 0, 1))

    def shift(self, pose: Similarity) -> Similarity:
        """D of a frame in which the head stands in a pose (head -> world)."""
        return pose.inverse().after(self.rest)

    def posed(self, points: NDArray[np.floating], pose: Similarity) -> Array:
        """(..., 3) where points of the layers (..., 3) are in that frame, in the head's own frame."""
        x = np.asarray(points, np.float64)
        return np.asarray(x + self.share(x)[..., None] * (self.shift(pose).apply(x) - x))
