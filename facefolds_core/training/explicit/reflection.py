"""Fit of the shared reflection (`model.reflection`) while the explicit model is trained.

For a ray with the opacity o, the mean place (s, t) of what it shows and the direction r of its reflection, the photo's
difference from the rendering without reflections is, mean over frames,

    R = o (gloss(s, t) E(r) - m(s, t)),

linear in each of gloss, E and m: they are solved for in turn, each a banded system, with smooth maps. m takes up what
does not depend on the view. Between fits the reflection is a given colour of each ray, which the textures are trained
with. Whether there is any is asked of cameras that a fit did not see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import ndimage
from scipy.linalg import solveh_banded

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window, texel_uv
from facefolds_core.model.reflection import Reflection, ReflectionShape
from facefolds_core.params import ReflectionParams
from facefolds_core.training.explicit.reflection_kernel import normal_equations, reflect, reflect_turned, sample

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Seen:
    """P rays, mean over frames.

    Attributes:
        camera: (P,).
        directions: (P, 3) unit vectors in the head's frame.
        st: (P, 2) place of what shows.
        opacity: (P,).
        residual: (P, 3) photo minus rendering without reflections.
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
    ) -> Seen:
        """From the sums (P, 6) of `reflection_kernel.look` over some frames; `turn`: (3, 3) of all its rays."""
        st = np.asarray(sums[:, 4:] / np.maximum(sums[:, 3:4], 1e-6), np.float32)
        mean = np.asarray(sums / frames, np.float32)
        turns = None if turn is None else np.repeat(turn[None].astype(np.float32), len(st), 0)
        return cls(camera, directions, st, mean[:, 3], mean[:, :3], turns)

    @classmethod
    def together(cls, parts: Sequence[Seen]) -> Seen:
        """The rays of several, which all have turns."""
        names = [field.name for field in fields(cls)]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})

    def part(self, chosen: NDArray[Any]) -> Seen:
        return Seen(
            self.camera[chosen],
            self.directions[chosen],
            self.st[chosen],
            self.opacity[chosen],
            self.residual[chosen],
            None if self.turns is None else self.turns[chosen],
        )


@dataclass(frozen=True)
class Maps:
    """Values of `model.reflection.Reflection`, float32."""

    gloss: Array
    offset: Array
    normals: Array
    environment: Array

    @classmethod
    def blank(cls, window: Window, params: ReflectionParams) -> Maps:
        """The same gloss everywhere, and no light; maps with texels as wide as high."""
        u0, u1, v0, v1 = window
        scale = params.texels / max(u1 - u0, v1 - v0)
        h, w = max(2, round(scale * (u1 - u0))), max(2, round(scale * (v1 - v0)))
        e = params.environment_texels
        return cls(
            *(np.full(s, v, np.float32) for s, v in (((h, w), 1), ((h, w, 3), 0), ((h, w, 3), 1), ((e, e, 3), 0)))
        )

    def positions(self, seen: Seen) -> Array:
        """(P, 2) in the environment."""
        out = np.empty((len(seen.st), 2), np.float32)
        st, directions = np.ascontiguousarray(seen.st), np.ascontiguousarray(seen.directions)
        if seen.turns is None:
            reflect(st, directions, self.normals, out)
        else:
            reflect_turned(st, directions, np.ascontiguousarray(seen.turns), self.normals, out)
        return out

    def added(self, seen: Seen) -> Array:
        """(P, 3), as `Reflection.added`."""
        light, st = values_at(self.environment, self.positions(seen)), seen.st
        return np.asarray(values_at(self.gloss[..., None], st) * light - values_at(self.offset, st), np.float32)

    def model(self) -> Reflection:
        h, w = self.gloss.shape
        module = Reflection(ReflectionShape((h, w), len(self.environment)))
        with torch.no_grad():
            for name in ("gloss", "offset", "normals", "environment"):
                getattr(module, name).copy_(torch.from_numpy(getattr(self, name)))
        return module


def surface_normals(
    middle: NDArray[np.float64], chart: Chart, window: Window, shape: tuple[int, int], blur: float
) -> Array:
    """(h, w, 3) unit normals, outwards, of the surface with radii `middle` (rows, columns at its nodes), smoothed by
    `blur` nodes."""
    radii = ndimage.gaussian_filter(middle, blur, mode="nearest")
    rows, columns = radii.shape
    u0, u1, v0, v1 = window
    uv = np.stack(np.meshgrid(np.linspace(u1, u0, rows), np.linspace(v0, v1, columns), indexing="ij"), -1)
    points = chart.points(uv, radii)
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    h, w = shape
    places = np.meshgrid((np.arange(h) + 0.5) / h * (rows - 1), (np.arange(w) + 0.5) / w * (columns - 1), indexing="ij")
    found = np.stack([ndimage.map_coordinates(normals[..., q], places, order=1) for q in range(3)], -1)
    outwards = (found * chart.directions(texel_uv(h, w, window))).sum(-1, keepdims=True)
    found *= np.where(outwards < 0, -1, 1) / np.linalg.norm(found, axis=-1, keepdims=True)
    return np.asarray(found, np.float32)


def fit_maps(seen: Seen, start: Maps, rounds: int, params: ReflectionParams) -> Maps:
    """Gloss, offset and environment that explain the residuals; the normals are those of `start`."""
    o, clip = seen.opacity, params.max_residual
    wanted = seen.residual.clip(-clip, clip)
    places = start.positions(seen)
    gloss, offset, environment = start.gloss, start.offset, start.environment
    for _ in range(rounds):
        reflecting = o * values_at(gloss[..., None], seen.st)[:, 0]
        target = wanted + o[:, None] * values_at(offset, seen.st)
        environment = _solve(
            places, reflecting**2, reflecting[:, None] * target, environment.shape[:2], params.environment_smoothness
        )
        light = values_at(environment, places)
        along = (light * target).sum(1, keepdims=True) * o[:, None]
        gloss = _solve(seen.st, (o * o) * (light**2).sum(1), along, gloss.shape, params.gloss_smoothness)[..., 0]
        gloss = np.maximum(gloss, np.float32(0))
        mean = np.float32(max(float(gloss.mean()), 1e-6))
        gloss, environment, light = gloss / mean, environment * mean, light * mean
        left = o[:, None] * values_at(gloss[..., None], seen.st) * light - wanted
        offset = _solve(seen.st, o * o, o[:, None] * left, gloss.shape, params.gloss_smoothness)
    return replace(start, gloss=gloss, offset=offset, environment=environment)


def grounded(maps: Maps) -> Maps:
    """The same with an environment that begins at 0: what is taken off it goes to the offset."""
    darkest = maps.environment.min((0, 1))
    return replace(maps, environment=maps.environment - darkest, offset=maps.offset - maps.gloss[..., None] * darkest)


def centred(maps: Maps, seen: Seen, params: ReflectionParams) -> Maps:
    """The same with the offset that leaves the mean over the rays at every place as it is without reflections."""
    light = values_at(maps.environment, maps.positions(seen)) * values_at(maps.gloss[..., None], seen.st)
    weight = seen.opacity**2
    offset = _solve(seen.st, weight, weight[:, None] * light, maps.gloss.shape, params.gloss_smoothness)
    return replace(maps, offset=offset)


def gain_on_cameras(seen: Seen, start: Maps, params: ReflectionParams) -> float:
    """dB that the reflection wins on rays of cameras that its fit did not see, each camera left out once."""
    before = after = 0.0
    for fold in range(params.folds):
        out = seen.camera % params.folds == fold
        if out.all() or not out.any():
            continue
        maps = fit_maps(seen.part(~out), start, params.first_rounds, params)
        unseen = seen.part(out)
        added = unseen.opacity[:, None] * maps.added(unseen)
        clipped = unseen.residual.clip(-params.max_residual, params.max_residual).astype(np.float64)
        before += float((clipped**2).sum())
        after += float(((clipped - added) ** 2).sum())
    return 10 * float(np.log10(before / after)) if after > 0 and before > 0 else 0.0


def values_at(image: Array, st: Array) -> Array:
    """(h, w, C) at (P, 2) -> (P, C)."""
    out = np.empty((len(st), image.shape[2]), np.float32)
    sample(np.ascontiguousarray(image), np.ascontiguousarray(st), out)
    return out


def _solve(st: Array, weight: Array, wish: Array, shape: tuple[int, ...], smoothness: float) -> Array:
    """(h, w, C): the smooth grid of least sum weight |x(st)|^2 - 2 x(st) . wish."""
    h, w = shape
    band, right = np.zeros((w + 2, h * w)), np.zeros((h * w, wish.shape[1]))
    normal_equations(
        np.ascontiguousarray(st), weight.astype(np.float32), np.ascontiguousarray(wish, np.float32), h, w, band, right
    )
    scale = float(band[0].mean()) + 1e-12
    _add_smoothness(band, h, w, smoothness * scale)
    band[0] += 1e-3 * scale
    return np.asarray(solveh_banded(band, right, lower=True).reshape(h, w, -1), np.float32)


def _add_smoothness(band: NDArray[np.float64], height: int, width: int, weight: float) -> None:
    """Squared differences of neighbours, added to a banded matrix."""
    index = np.arange(height * width).reshape(height, width)
    for first, second in ((index[:, :-1], index[:, 1:]), (index[:-1], index[1:])):
        band[0] += weight * np.bincount(np.concatenate([first.ravel(), second.ravel()]), minlength=height * width)
        band[second.ravel() - first.ravel(), first.ravel()] -= weight
