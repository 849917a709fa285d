"""Where frames have not followed what moves: steps of each frame alone, on few texels and the rays that meet them.

A blink is in one frame of twelve, on a hundredth of the texels. The steps before make all frames alike where they
are alike, and share what a step costs among all texels; a lid that closes in one frame would need many more of them.
Which texels lag is seen in the pictures: C - I, averaged over the rays that meet a texel, with the rays of all cameras,
is small of a texel that is right, whatever the noise of single pixels. What it is in all frames is no motion, but
where something moves: there the static part is a mean over the frames.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.kernels.adam import corrections, decays
from facefolds_core.kernels.hit_codes import before
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit import follow_kernel, shading_kernel
from facefolds_core.training.explicit.rates import ALPHA_RATE, BETAS, falling
from facefolds_core.training.explicit.state import MIN_ALPHA, MIN_LIGHT, TextureState
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.views import RaySource, Views

Light = Callable[[TextureState, Views, int], None]
"""Sets the state's `shine` for rays of a frame."""

Errors = NDArray[np.float32]


def follow(
    state: TextureState,
    source: RaySource,
    pictures: CutOuts,
    rates: NDArray[np.float32],
    light: Light,
) -> tuple[Errors, float]:
    """All frames, each where its texels' mean error differs from their usual one.

    Args:
        rates: (2,) of colour and of logits of alpha, in the first step.

    Returns:
        (M, 3) the usual mean errors, 0 where something moves; the share of the texels that moved, mean over the
        frames.
    """
    frames, least = len(state.steps), state.params.follow.min_error
    errors = np.stack([mean_errors(state, source, pictures, k, light) for k in range(frames)])
    usual = np.median(errors, 0).astype(np.float32)
    moves = np.any([lagging(one - usual, state.shape, least) for one in errors], 0)
    usual[moves] = 0  # there the static part is a mean of what moves, and errs in all frames
    lag = [lagging(one - usual, state.shape, least) & moves for one in errors]
    for frame, chosen in enumerate(lag):
        follow_frame(state, source, pictures, frame, chosen, errors[frame], rates, light)
    return usual, float(np.mean(lag))


def follow_rates(params: ExplicitParams) -> NDArray[np.float32]:
    """(2,) for colours and for logits of alpha."""
    return params.follow.rate * np.array([1, ALPHA_RATE], np.float32)


def mean_errors(state: TextureState, source: RaySource, pictures: CutOuts, frame: int, light: Light) -> Errors:
    """(M, 3): mean C - I over the rays that meet each texel; 0 of texels that show less than half a ray."""
    (h, w), n = state.shape, state.layers.shape[2]
    sums, texture = state.gradient.numpy().reshape(n, h, w, 4), _texture(state, frame)
    cut, behind, least = pictures.cut(frame), pictures.behind, MIN_LIGHT
    shares = list(source.in_use(frame))
    enough = 4 * state.params.textures.rays_per_texel * h * w  # as many rays as of four steps
    apart = max(1, int(sum(len(views.pixel) for views in shares) / enough))
    for views in shares:
        light(state, views, frame)
        rays = *views.arrays, np.arange(0, len(views.pixel), apart)
        shading_kernel.shade(*rays, cut, behind, texture, state.shine, sums, 0.0, least, True)
    total = sums.sum(0, dtype=np.float32).reshape(h * w, 4)
    sums[:] = 0
    known = total[:, 3:] >= 0.5
    return np.where(known, total[:, :3] / np.where(known, total[:, 3:], 1), 0)


def lagging(errors: Errors, shape: tuple[int, int], least: float) -> NDArray[np.bool_]:
    """(M,) texels with a channel in error by more than `least`, and their eight neighbours, which share their rays."""
    found = (np.abs(errors).max(1) > least).reshape(shape)
    return np.asarray(ndimage.binary_dilation(found, np.ones((3, 3)))).ravel()


def follow_frame(
    state: TextureState,
    source: RaySource,
    pictures: CutOuts,
    frame: int,
    chosen: NDArray[np.bool_],
    errors: Errors,
    rates: NDArray[np.float32],
    light: Light,
) -> None:
    """What one frame adds at the chosen texels (M,): its colour less the mean errors (M, 3), a step as far as it takes;
    then Adam steps on the rays whose light comes to them."""
    views, shine = _rays_on(state, source, frame, chosen, light)
    if not len(views.pixel):
        return
    (h, w), n = state.shape, state.layers.shape[2]
    own, near = np.flatnonzero(chosen), _met(views, state.shape)
    near = np.union1d(own, near)
    colours, alphas = np.zeros((2, len(own), 3), np.float32), np.zeros((2, len(own), n), np.float32)
    values = state.frame_colour[0, frame].numpy(), state.frame_alpha[0, frame].numpy()
    values[0][own] -= errors[own]
    cut, texture = pictures.cut(frame), _texture(state, frame)
    params = state.params.follow
    pictures.average()
    apart = _apart(len(views.pixel), h * w * state.params.textures.rays_per_texel)
    for step in range(params.steps):
        shading_kernel.shade(
            *views.arrays,
            np.arange(step % apart, len(views.pixel), apart),
            cut,
            pictures.behind,
            texture,
            shine,
            state.gradient.numpy().reshape(n, h, w, 4),
            MIN_ALPHA,
            MIN_LIGHT,
            False,
        )
        follow_kernel.follow_step(
            own,
            near,
            state.colour[0].numpy(),
            state.layers[0].numpy(),
            *values,
            colours,
            alphas,
            texture.reshape(h * w, n, 4),
            state.gradient.numpy(),
            rates * np.float32(falling(step / params.steps)),
            np.array(corrections(BETAS, step + 1), np.float32),
            decays(BETAS),
        )


def _texture(state: TextureState, frame: int) -> NDArray[np.float32]:
    """(H, W, N, 4) of one frame."""
    (h, w), n = state.shape, state.layers.shape[2]
    return state.activated(frame).numpy().reshape(h, w, n, 4)


def _rays_on(
    state: TextureState, source: RaySource, frame: int, chosen: NDArray[np.bool_], light: Light
) -> tuple[Views, NDArray[np.float32]]:
    """The rays of which enough light comes to chosen texels, and what the reflection adds to them. Texels that are
    transparent count as well: rays that end behind them are what keeps them so."""
    texture, least, params = _texture(state, frame), MIN_LIGHT, state.params.follow
    parts, shine = [], []
    for views in source.in_use(frame):
        light(state, views, frame)
        found = follow_kernel.light_on(views.codes, texture, chosen.reshape(state.shape), least)
        rays = np.flatnonzero(found >= params.min_light)
        parts.append(views.part(rays))
        shine.append(state.shine[rays] if len(state.shine) else state.shine)
    return Views.together(parts), np.concatenate(shine)


def _apart(rays: int, usual: float) -> int:
    """One of so many rays is taken in a step: every second, and at most a quarter as many as in a `usual` step, so that
    a capture in which everything moves takes little longer, too."""
    return max(2, math.ceil(rays / (usual / 4)))


def _met(views: Views, shape: tuple[int, int]) -> NDArray[np.int64]:
    """Texels around all crossings of rays, with any layer; layer by layer, since there may be many rays."""
    met = np.zeros(shape[0] * shape[1], bool)
    for codes in (views.codes, views.finer.reshape(-1, *views.codes.shape[1:])):
        for n in range(codes.shape[1]):
            column, row = (before(codes[:, n, axis], size) for axis, size in ((0, shape[1]), (1, shape[0])))
            met[row * shape[1] + column] = True
    corners = np.flatnonzero(met)
    for step in (1, shape[1], shape[1] + 1):
        met[corners + step] = True
    return np.flatnonzero(met)
