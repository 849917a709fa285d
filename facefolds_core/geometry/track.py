"""Where a head stands in each frame: a rigid motion head -> world a frame, and between frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facefolds_core.geometry.cameras import Array, Camera
from facefolds_core.geometry.quaternions import quaternion, rotation
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.torso import Torso

UNIT = 1e-6
"""How far from 1 the length of a quaternion may be in a file."""


@dataclass(frozen=True)
class Track:
    """K rigid motions X_world = R X_head + t, normalised units.

    Attributes:
        quaternions: (K, 4) w, x, y, z of R, of unit length; neighbours are less than half a turn apart (q or -q).
        translations: (K, 3) t.
        torso: what stays in the room; None where all moves with the head, or as long as that is not known.
    """

    quaternions: Array
    translations: Array
    torso: Torso | None = None

    @classmethod
    def of(cls, rotations: ArrayLike, translations: ArrayLike) -> Track:
        """From rotations (K, 3, 3) and translations (K, 3)."""
        quaternions = np.array([quaternion(R) for R in np.asarray(rotations, float)])
        for k in range(1, len(quaternions)):
            if quaternions[k] @ quaternions[k - 1] < 0:
                quaternions[k] *= -1
        return cls(quaternions, np.array(translations, float).reshape(-1, 3))

    def __len__(self) -> int:
        return len(self.quaternions)

    def at(self, time: float) -> Similarity:
        """Head -> world at a time in units of frames: on the shortest arc between frames, held beyond the ends."""
        time = min(max(time, 0.0), len(self) - 1.0)
        first = min(int(time), len(self) - 1)
        second, share = min(first + 1, len(self) - 1), time - first
        q = slerp(self.quaternions[first], self.quaternions[second], share)
        t = (1 - share) * self.translations[first] + share * self.translations[second]
        return Similarity(1.0, rotation(q), t)

    def camera(self, camera: Camera, time: float) -> Camera:
        """A camera of the world as it stands in the head's frame at a time."""
        return camera.transformed(self.at(time).inverse())

    def posed(self, points: NDArray[np.floating], time: float) -> Array:
        """(..., 3) where points of the layers, as these were made, are at a time, in the head's own frame."""
        return points.astype(np.float64) if self.torso is None else self.torso.posed(points, self.at(time))

    def degrees(self) -> Array:
        """(K,) of the turn in each frame."""
        cosine = np.clip(np.abs(self.quaternions[:, 0]), 0, 1)
        return np.asarray(np.degrees(2 * np.arccos(cosine)))

    def nearest(self) -> int:
        """The frame that stands nearest to the head's own frame: the least sum of turn (radians) and shift (units)."""
        return int((np.radians(self.degrees()) + np.linalg.norm(self.translations, axis=1)).argmin())

    def problems(self, frames: int) -> list[str]:
        """What is wrong with a track of so many frames, in words."""
        if self.quaternions.shape != (frames, 4) or self.translations.shape != (frames, 3):
            return [f"{self.quaternions.shape} quaternions and {self.translations.shape} translations, {frames} frames"]
        if not (np.isfinite(self.quaternions).all() and np.isfinite(self.translations).all()):
            return ["numbers that are not finite"]
        off = np.abs(np.linalg.norm(self.quaternions, axis=1) - 1)
        return [f"quaternion {int(off.argmax())} is not of unit length"] if off.max() > UNIT else []


def slerp(first: Array, second: Array, share: float) -> Array:
    """Along the shorter arc between unit quaternions (Shoemake 1985)."""
    cosine = float(first @ second)
    if cosine < 0:
        second, cosine = -second, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-8:
        return first
    mixed: Array = (np.sin((1 - share) * angle) * first + np.sin(share * angle) * second) / np.sin(angle)
    return mixed / np.linalg.norm(mixed)


def turn_of(vector: Array) -> Array:
    """(3, 3) rotation about a vector (3,) by its length, radians."""
    angle = float(np.linalg.norm(vector))
    axis = vector / max(angle, 1e-30)
    return rotation(np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)]))


def own_track(poses: Sequence[Similarity], middles: Array) -> Track:
    """The motion against the mean pose: its rotation is the mean, and it has the head's middle where it is on average.

    Args:
        poses: K rigid motions of something that moves with the head -> world.
        middles: (K, 3) of the head, in the world.
    """
    there = np.mean([pose.inverse().apply(middle) for pose, middle in zip(poses, middles, strict=True)], 0)
    mean = mean_rotation([pose.rotation for pose in poses])
    still = Similarity(1.0, mean, middles.mean(0) - mean @ there)
    against = [pose.after(still.inverse()) for pose in poses]
    return Track.of([one.rotation for one in against], [one.translation for one in against])


def mean_rotation(rotations: Sequence[Array] | Array) -> Array:
    """(3, 3) the rotation nearest to the mean of rotations (K, 3, 3) (chordal mean; Hartley et al. 2013)."""
    u, _, vt = np.linalg.svd(np.mean(np.asarray(rotations), 0))
    return np.asarray(u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt)


def rigid_motion(source: Array, target: Array) -> tuple[Array, Array]:
    """R, t with target = R source + t for points (V, 3), robustly (Procrustes; Cauchy's weights at twice the median
    residual): what moves by itself, as a jaw, counts little."""
    weights = np.ones(len(source))
    R, t = np.eye(3), np.zeros(3)
    for _ in range(10):
        a = np.average(source, axis=0, weights=weights)
        b = np.average(target, axis=0, weights=weights)
        u, _, vt = np.linalg.svd((target - b).T @ (weights[:, None] * (source - a)))
        R = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
        t = b - R @ a
        off = np.linalg.norm(source @ R.T + t - target, axis=1)
        weights = 1 / (1 + (off / (2 * np.median(off) + 1e-12)) ** 2)
    return R, t
