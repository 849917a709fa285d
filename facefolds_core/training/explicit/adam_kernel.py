"""Activation of the texture grids, their Adam step, and the smoothing of their opacity, compiled.

Reference: `tests/training/reference.py`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from facefolds_core.kernels.adam import adam
from facefolds_core.kernels.jit import compiled, inlined, kernel


@kernel(parallel=True)
def activate(colour, layers, frame_colour, frame_alpha, out):  # type: ignore[no-untyped-def]
    """(M, 3), (M, N, 4), (M, 3), (M, N) -> out (M, N, 4): rgb and alpha in [0, 1], see `GridTextures`."""
    for k in prange(layers.shape[0]):
        activate_texel(k, colour, layers, frame_colour, frame_alpha, out)


@compiled
def activate_texel(k: Any, colour: Any, layers: Any, frame_colour: Any, frame_alpha: Any, out: Any) -> None:
    """`activate` of all layers of texel k."""
    for n in range(layers.shape[1]):
        for q in range(3):
            value = colour[k, q] + frame_colour[k, q] + layers[k, n, q]
            out[k, n, q] = min(max(value, np.float32(0.0)), np.float32(1.0))
        out[k, n, 3] = 1 / (1 + math.exp(-(layers[k, n, 3] + frame_alpha[k, n])))


@inlined
def _adam(values, first, second, index, g, rate, correct1, correct2, decay):  # type: ignore[no-untyped-def]
    """One Adam step on values[index]."""
    values[index] -= adam(first, second, index, g, rate, correct1, correct2, decay)


@kernel(parallel=True)
def adam_step(  # type: ignore[no-untyped-def]
    colour,  # (3, M, 3): values, first and second moments
    layers,  # (3, M, N, 4)
    frame_colour,  # (3, M, 3)
    frame_alpha,  # (3, M, N)
    texture,  # (M, N, 4) as activated
    gradient,  # (N, M, 4) with respect to `texture`; zero afterwards
    rates,  # (5,) of colour, layer colour, alpha, frame colour, frame alpha
    correct,  # (4,) bias corrections of both moments, of the static and of this frame's parts
    decay,  # (4,) of `adam.decays`
):
    """Adam on the texels that the rays have met; the others stay as they are, moments included."""
    colour0, colour1, colour2 = colour[0], colour[1], colour[2]
    layers0, layers1, layers2 = layers[0], layers[1], layers[2]
    frame0, frame1, frame2 = frame_colour[0], frame_colour[1], frame_colour[2]
    fade0, fade1, fade2 = frame_alpha[0], frame_alpha[1], frame_alpha[2]
    for k in prange(layers.shape[1]):
        sum0, sum1, sum2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        met = False
        # The clamp passes the gradient on: a colour at its border can come back.
        for n in range(layers0.shape[1]):
            g0, g1, g2, g3 = gradient[n, k, 0], gradient[n, k, 1], gradient[n, k, 2], gradient[n, k, 3]
            if g0 == 0 and g1 == 0 and g2 == 0 and g3 == 0:
                continue
            for q in range(4):
                gradient[n, k, q] = 0
            met = True
            sum0 += g0
            sum1 += g1
            sum2 += g2
            for q in range(3):
                g = g0 if q == 0 else (g1 if q == 1 else g2)
                _adam(layers0, layers1, layers2, (k, n, q), g, rates[1], correct[0], correct[1], decay)
            alpha = texture[k, n, 3]
            g = g3 * alpha * (1 - alpha)
            _adam(layers0, layers1, layers2, (k, n, 3), g, rates[2], correct[0], correct[1], decay)
            layers0[k, n, 3] = min(max(layers0[k, n, 3], np.float32(-9.0)), np.float32(9.0))
            _adam(fade0, fade1, fade2, (k, n), g, rates[4], correct[2], correct[3], decay)
        if not met:
            continue
        for q in range(3):
            g = sum0 if q == 0 else (sum1 if q == 1 else sum2)
            _adam(colour0, colour1, colour2, (k, q), g, rates[0], correct[0], correct[1], decay)
            colour0[k, q] = min(max(colour0[k, q], np.float32(0.0)), np.float32(1.0))
            _adam(frame0, frame1, frame2, (k, q), g, rates[3], correct[2], correct[3], decay)


@kernel(parallel=True)
def smooth(values, height, width):  # type: ignore[no-untyped-def]
    """Mean over 3 x 3 texels, the outermost ones repeated beyond the border: the prior against opacity that only the
    training cameras see.

    Some thirty cameras do not determine the opacity of each texel of twelve layers by itself: left alone it becomes
    grain that shows each camera its own picture.

    Args:
        values: (height width, N) float32.

    Returns:
        the same of the means.
    """
    out = np.empty_like(values)
    layers = values.shape[1]
    for i in prange(height):
        sums = np.empty((width, layers), np.float32)  # of a texel, the one above, and the one below
        for j in range(width):
            above, below = max(i - 1, 0) * width + j, min(i + 1, height - 1) * width + j
            for n in range(layers):
                sums[j, n] = values[above, n] + values[i * width + j, n] + values[below, n]
        for j in range(width):
            left, right = max(j - 1, 0), min(j + 1, width - 1)
            for n in range(layers):
                out[i * width + j, n] = (sums[left, n] + sums[j, n] + sums[right, n]) * np.float32(1 / 9)
    return out
