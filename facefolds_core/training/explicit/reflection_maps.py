"""What the fit of the shared reflection (`reflection.py`) looks at and finds: rays, and maps over the window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window, texel_uv
from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.model.reflection import Reflection, ReflectionShape
from facefolds_core.params import ReflectionParams
from facefolds_core.subject.outline import window_uv
from facefolds_core.training.explicit.reflection_kernel import reflect, sample
from facefolds_core.training.explicit.views import Views

Array = NDArray[np.float32]

AT_ONCE = 1 << 20
"""Rays that are looked at together: bounds the memory."""

CLEAR = 0.1
"""A ray that is less opaque shows no place: the mean of where it meets the layers is mostly what noise there is."""


@dataclass(frozen=True)
class SeenRays:
    """P rays, mean over frames.

    Attributes:
        camera: (P,).
        directions: (P, 3) unit vectors in the head's frame.
        st: (P, 2) place of what shows.
        opacity: (P,).
        residual: (P, 3) cut-out minus rendering without reflections.
        turns: (P, 3, 3) of each ray from the head's axes to those of the room, which the light is fixed to; None where
            the head stands still.
    """

    camera: NDArray[np.int32]
    directions: Array
    st: Array
    opacity: Array
    residual: Array
    turns: Array | None = None

    @classmethod
    def of(
        cls, camera: NDArray[np.int32], directions: Array, sums: Array, frames: int, turn: Array | None = None
    ) -> SeenRays:
        """From the sums (P, 6) of `reflection_kernel.look` over some frames; `turn`: (3, 3) of all its rays."""
        st = np.asarray(sums[:, 4:] / np.maximum(sums[:, 3:4], 1e-6), np.float32)
        mean = np.asarray(sums / frames, np.float32)
        turns = None if turn is None else np.repeat(turn[None].astype(np.float32), len(st), 0)
        return cls(camera, directions, st, mean[:, 3], mean[:, :3], turns)

    @classmethod
    def middle(cls, views: Views, turn: NDArray[np.floating] | None = None) -> SeenRays:
        """Rays taken to be opaque where they cross the layer nearest to the middle one; no residuals are known."""
        count, layers = views.codes.shape[:2]
        at = np.zeros((count, 2), np.uint16)
        for n in sorted(range(layers), key=lambda n: abs(2 * n + 1 - layers)):
            at = np.where(at[:, :1] == 0, views.codes[:, n], at)
        st = ((at.astype(np.float32) - 1) / np.float32(SCALE)).clip(0, 1)
        turns = None if turn is None else np.broadcast_to(turn.astype(np.float32), (count, 3, 3))
        nothing = np.zeros((count, 3), np.float32)
        return cls(views.camera, views.directions, st, np.ones(count, np.float32), nothing, turns)

    def filled(self, views: Views) -> SeenRays:
        """The same rays; those that are clear, and show no place, are taken to reflect at the layer in the middle."""
        return replace(self, st=np.where(self.opacity[:, None] < CLEAR, SeenRays.middle(views).st, self.st))

    @classmethod
    def together(cls, parts: Sequence[SeenRays]) -> SeenRays:
        """The rays of several, which all have turns."""
        names = [field.name for field in fields(cls)]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})

    def part(self, chosen: NDArray[Any]) -> SeenRays:
        return SeenRays(
            self.camera[chosen],
            self.directions[chosen],
            self.st[chosen],
            self.opacity[chosen],
            self.residual[chosen],
            None if self.turns is None else self.turns[chosen],
        )


@dataclass(frozen=True)
class Maps:
    """Values of `model.reflection.Reflection`, float32.

    Attributes:
        surface: (h, w, 3) unit normals of the geometry.
        tilt: (h, w, 2) tangents of the angles by which the normals lean from these: see `tangents`.
    """

    gloss: Array
    offset: Array
    surface: Array
    tilt: Array
    environment: Array

    @property
    def normals(self) -> Array:
        """(h, w, 3) of about unit length."""
        return tilted(self.surface, self.tilt)

    @classmethod
    def blank(cls, surface: Array, params: ReflectionParams) -> Maps:
        """The same gloss everywhere, and no light, on a surface with normals (h, w, 3)."""
        h, w, e = *surface.shape[:2], params.environment_texels
        shapes = (h, w), (h, w, 3), (h, w, 2), (e, e, 3)
        gloss, offset, tilt, environment = (np.zeros(shape, np.float32) for shape in shapes)
        return cls(gloss + 1, offset, surface, tilt, environment)

    def positions(self, seen: SeenRays) -> Array:
        """(P, 2) in the environment."""
        out = np.empty((len(seen.st), 2), np.float32)
        st, directions = np.ascontiguousarray(seen.st), np.ascontiguousarray(seen.directions)
        turns = None if seen.turns is None else np.ascontiguousarray(seen.turns)
        reflect(st, directions, turns, self.normals, out)
        return out

    def added(self, seen: SeenRays) -> Array:
        """(P, 3), as `Reflection.added`."""
        light, st = values_at(self.environment, self.positions(seen)), seen.st
        return np.asarray(values_at(self.gloss[..., None], st) * light - values_at(self.offset, st), np.float32)

    def on_rays(self, views: Views, turn: NDArray[np.floating] | None = None) -> Array:
        """(P, 3) what is added to rays where they cross the layer in the middle; turn (3, 3) from the head's axes to
        the room's, None: they are the same."""
        parts = (
            views.part(np.arange(i, min(i + AT_ONCE, len(views.pixel)))) for i in range(0, len(views.pixel), AT_ONCE)
        )
        found = [self.added(SeenRays.middle(part, turn)) for part in parts]
        return np.concatenate(found) if found else np.zeros((0, 3), np.float32)

    @classmethod
    def of(cls, reflection: Reflection) -> Maps:
        """Of a model."""
        names = ("gloss", "offset", "normals", "environment")
        gloss, offset, surface, environment = (getattr(reflection, name).detach().cpu().numpy() for name in names)
        surface = surface / np.linalg.norm(surface, axis=-1, keepdims=True)
        return cls(gloss, offset, surface, np.zeros((*gloss.shape, 2), np.float32), environment)

    def model(self) -> Reflection:
        h, w = self.gloss.shape
        module = Reflection(ReflectionShape((h, w), len(self.environment)))
        with torch.no_grad():
            for name in ("gloss", "offset", "normals", "environment"):
                getattr(module, name).copy_(torch.from_numpy(getattr(self, name)))
        return module


def tangents(normals: Array) -> tuple[Array, Array]:
    """Two unit tangents (..., 3) at right angles of unit normals (..., 3): +y and +z, turned as +x is to become the
    normal by the shortest way, so that they change slowly; within 4 degrees of -x they are shorter."""
    x, y, z = (normals[..., q] for q in range(3))
    share = 1 / np.maximum(1 + x, np.float32(1e-3))
    twist = -y * z * share
    return np.stack([-y, 1 - y * y * share, twist], -1), np.stack([-z, twist, 1 - z * z * share], -1)


def tilted(normals: Array, tilt: Array) -> Array:
    """Unit normals (..., 3) that lean by tilt (..., 2) along their two tangents."""
    first, second = tangents(normals)
    found = normals + tilt[..., :1] * first + tilt[..., 1:] * second
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True), np.float32)


def surface_normals(
    middle: NDArray[np.float64], chart: Chart, window: Window, shape: tuple[int, int], blur: float
) -> Array:
    """(h, w, 3) unit normals, outwards, of the surface with radii `middle` (rows, columns at its nodes), smoothed by
    `blur` nodes."""
    radii = ndimage.gaussian_filter(middle, blur, mode="nearest")
    rows, columns = radii.shape
    points = chart.points(window_uv(window, rows, columns), radii)
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    h, w = shape
    places = np.meshgrid((np.arange(h) + 0.5) / h * (rows - 1), (np.arange(w) + 0.5) / w * (columns - 1), indexing="ij")
    found = np.stack([ndimage.map_coordinates(normals[..., q], places, order=1) for q in range(3)], -1)
    outwards = (found * chart.directions(texel_uv(h, w, window))).sum(-1, keepdims=True)
    found *= np.where(outwards < 0, -1, 1) / np.linalg.norm(found, axis=-1, keepdims=True)
    return np.asarray(found, np.float32)


def values_at(image: Array, st: Array) -> Array:
    """(h, w, C) at (P, 2) -> (P, C)."""
    out = np.empty((len(st), image.shape[2]), np.float32)
    sample(np.ascontiguousarray(image), np.ascontiguousarray(st), out)
    return out
