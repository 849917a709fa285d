"""Fit of the shared reflection (`model.reflection`) while the explicit model is trained.

For a ray with the opacity o, the mean place (s, t) of what it shows and the direction r of its reflection, the
cut-out's difference from the rendering without reflections is, mean over frames,

    R = o (gloss(s, t) E(r) - m(s, t)),

linear in each of gloss, E and m: they are solved for in turn, each a banded system, with smooth maps; then the normals
lean, by Gauss-Newton steps. m takes up what does not depend on the view. Between fits the reflection is a given colour
of each ray, which the textures are trained with. Whether there is any is asked of cameras that a fit did not see.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from facefolds_core.params import ReflectionParams
from facefolds_core.training.explicit.reflection_kernel import normal_equations
from facefolds_core.training.explicit.reflection_maps import Array, Maps, Seen, values_at

TILT_STEP = 0.01
"""By which normals lean to find how the reflection follows them: under a tenth of a texel of the environment."""


def fit_maps(seen: Seen, start: Maps, rounds: int, params: ReflectionParams) -> Maps:
    """Gloss, offset, environment and the tilt of the normals that explain the residuals; the surface is that of
    `start`."""
    o, clip = seen.opacity, params.max_residual
    wanted = seen.residual.clip(-clip, clip)
    maps = start
    for _ in range(rounds):
        places = maps.positions(seen)
        gloss, offset, environment = maps.gloss, maps.offset, maps.environment
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
        maps = replace(maps, gloss=gloss, offset=offset, environment=environment)
        if params.normals:
            for axis in (0, 1):
                maps = _lean(maps, seen, wanted, axis, params)
    return maps


def _lean(maps: Maps, seen: Seen, wanted: Array, axis: int, params: ReflectionParams) -> Maps:
    """The same with another tilt along one tangent: a Gauss-Newton step, kept within `max_tilt`."""
    step = np.zeros((1, 1, 2), np.float32)
    step[..., axis] = TILT_STEP
    now, own = seen.opacity[:, None] * maps.added(seen), maps.tilt[..., axis : axis + 1]
    further = seen.opacity[:, None] * replace(maps, tilt=maps.tilt + step).added(seen)
    slope = (further - now) / np.float32(TILT_STEP)
    target = wanted - now + slope * values_at(own, seen.st)
    weight = (slope * slope).sum(1)
    found = _solve(seen.st, weight, (slope * target).sum(1, keepdims=True), own.shape[:2], params.normal_smoothness)
    tilt = maps.tilt.copy()
    tilt[..., axis] = found[..., 0].clip(-params.max_tilt, params.max_tilt)
    return replace(maps, tilt=tilt)


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
    params = smoothed(params, params.asked_smoothness)
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


def smoothed(params: ReflectionParams, factor: float) -> ReflectionParams:
    """With the smoothnesses of gloss, offset and environment times `factor`."""
    names = "gloss_smoothness", "environment_smoothness"
    return params.model_copy(update={name: factor * getattr(params, name) for name in names})


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
