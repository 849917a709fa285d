"""Fit of the shared reflection (`model.reflection`) while the explicit model is trained.

For a ray with the opacity o, the mean place (s, t) of what it shows and the direction r of its reflection, the
cut-out's difference from the rendering without reflections is, mean over frames,

    R = o (gloss(s, t) E(r) - m(s, t)),

linear in each of gloss, E and m: they are solved for in turn, each a banded system, with smooth maps; then the normals
lean, by Gauss-Newton steps. m takes up what does not depend on the view. Between fits the reflection is a given colour
of each ray, which the textures are trained with. Whether there is any is asked of cameras that a fit did not see.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from facefolds_core.training.explicit.reflection_kernel import normal_equations
from facefolds_core.training.explicit.reflection_maps import Array, Maps, SeenRays, values_at

TILT_STEP = 0.01
"""By which normals lean to find how the reflection follows them: under a tenth of a texel of the environment."""


@dataclass(frozen=True)
class GlossMethod:
    """How the reflection is fitted, and how it is asked whether there is one.

    Attributes:
        normal_blur: smoothing of the radius map before normals are taken of it, standard deviation, nodes.
        normal_smoothness: weight of the smoothness of how they lean.
        max_tilt: largest tangent of the angle by which they lean, along each of two tangents.
        gloss_smoothness: weight of the smoothness of gloss and offset.
        environment_smoothness: weight of the smoothness of the environment.
        frames: whose mean is looked at, at most.
        moving_frames: of a turning head that are looked at one by one, at most.
        rays: looked at in a fit, at most.
        rounds: times that its parts are solved for in turn, in a fit.
        first_rounds: such times in the first fit, and in those that tell whether the reflection helps.
        min_opacity: rays that are less opaque are left out of the fits.
        max_residual: larger differences between photo and model are clipped.
        folds: groups of cameras that are left out in turn to tell whether it helps.
        asked_smoothness: factor on the smoothness in the fits that tell whether it helps, which have fewer cameras.
        smoother: factor on the smoothness with which it is asked again where it gains little.
        sure_gain: gain on cameras left out, dB, from which on no smoother one is asked for.
        min_gain: least gain on cameras left out, dB; with less there is no reflection.
    """

    normal_blur: float = 1.5
    normal_smoothness: float = 0.3
    max_tilt: float = 0.3
    gloss_smoothness: float = 0.1
    environment_smoothness: float = 0.03
    frames: int = 3
    moving_frames: int = 8
    rays: int = 300_000
    rounds: int = 4
    first_rounds: int = 12
    min_opacity: float = 0.9
    max_residual: float = 0.25
    folds: int = 4
    asked_smoothness: float = 10.0
    smoother: float = 10.0
    sure_gain: float = 0.5
    min_gain: float = 0.05


GLOSS = GlossMethod()


def fit_maps(seen: SeenRays, start: Maps, rounds: int, how: GlossMethod, smoother: float = 1.0) -> Maps:
    """Gloss, offset, environment and the tilt of the normals that explain the residuals; the surface is that of
    `start`.

    Args:
        smoother: times as smooth as usual gloss, offset and environment are.
    """
    gloss_smoothness, environment_smoothness = smoother * how.gloss_smoothness, smoother * how.environment_smoothness
    o, clip = seen.opacity, how.max_residual
    wanted = seen.residual.clip(-clip, clip)
    maps = start
    for _ in range(rounds):
        places = maps.positions(seen)
        gloss, offset, environment = maps.gloss, maps.offset, maps.environment
        reflecting = o * values_at(gloss[..., None], seen.st)[:, 0]
        target = wanted + o[:, None] * values_at(offset, seen.st)
        environment = _solve(
            places, reflecting**2, reflecting[:, None] * target, environment.shape[:2], environment_smoothness
        )
        light = values_at(environment, places)
        along = (light * target).sum(1, keepdims=True) * o[:, None]
        gloss = _solve(seen.st, (o * o) * (light**2).sum(1), along, gloss.shape, gloss_smoothness)[..., 0]
        gloss = np.maximum(gloss, np.float32(0))
        mean = np.float32(max(float(gloss.mean()), 1e-6))
        gloss, environment, light = gloss / mean, environment * mean, light * mean
        left = o[:, None] * values_at(gloss[..., None], seen.st) * light - wanted
        offset = _solve(seen.st, o * o, o[:, None] * left, gloss.shape, gloss_smoothness)
        maps = replace(maps, gloss=gloss, offset=offset, environment=environment)
        for axis in (0, 1):
            maps = _lean(maps, seen, wanted, axis, how)
    return maps


def _lean(maps: Maps, seen: SeenRays, wanted: Array, axis: int, how: GlossMethod) -> Maps:
    """The same with another tilt along one tangent: a Gauss-Newton step, kept within `max_tilt`."""
    step = np.zeros((1, 1, 2), np.float32)
    step[..., axis] = TILT_STEP
    now, own = seen.opacity[:, None] * maps.added(seen), maps.tilt[..., axis : axis + 1]
    further = seen.opacity[:, None] * replace(maps, tilt=maps.tilt + step).added(seen)
    slope = (further - now) / np.float32(TILT_STEP)
    target = wanted - now + slope * values_at(own, seen.st)
    weight = (slope * slope).sum(1)
    found = _solve(seen.st, weight, (slope * target).sum(1, keepdims=True), own.shape[:2], how.normal_smoothness)
    tilt = maps.tilt.copy()
    tilt[..., axis] = found[..., 0].clip(-how.max_tilt, how.max_tilt)
    return replace(maps, tilt=tilt)


def grounded(maps: Maps) -> Maps:
    """The same with an environment that begins at 0: what is taken off it goes to the offset."""
    darkest = maps.environment.min((0, 1))
    return replace(maps, environment=maps.environment - darkest, offset=maps.offset - maps.gloss[..., None] * darkest)


def centred(maps: Maps, seen: SeenRays, how: GlossMethod, smoother: float = 1.0) -> Maps:
    """The same with the offset that leaves the mean over the rays at every place as it is without reflections."""
    light = values_at(maps.environment, maps.positions(seen)) * values_at(maps.gloss[..., None], seen.st)
    weight = seen.opacity**2
    offset = _solve(seen.st, weight, weight[:, None] * light, maps.gloss.shape, smoother * how.gloss_smoothness)
    return replace(maps, offset=offset)


def gain_on_cameras(seen: SeenRays, start: Maps, how: GlossMethod, smoother: float = 1.0) -> float:
    """dB that the reflection wins on rays of cameras that its fit did not see, each camera left out once."""
    before = after = 0.0
    for fold in range(how.folds):
        out = seen.camera % how.folds == fold
        if out.all() or not out.any():
            continue
        maps = fit_maps(seen.part(~out), start, how.first_rounds, how, smoother * how.asked_smoothness)
        unseen = seen.part(out)
        added = unseen.opacity[:, None] * maps.added(unseen)
        clipped = unseen.residual.clip(-how.max_residual, how.max_residual).astype(np.float64)
        before += float((clipped**2).sum())
        after += float(((clipped - added) ** 2).sum())
    return 10 * float(np.log10(before / after)) if after > 0 and before > 0 else 0.0


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
