"""Steps on texels of one frame that do not follow what moves, and which rays show those, compiled.

Reference: `tests/training/reference.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange

from facefolds_core.kernels.adam import adam
from facefolds_core.kernels.jit import compiled, kernel
from facefolds_core.training.explicit.adam_kernel import activate_texel
from facefolds_core.training.explicit.shading_kernel import tap_share


@kernel(parallel=True)
def light_on(codes, texture, chosen, min_light):  # type: ignore[no-untyped-def]
    """(P,) float32: how much light of each ray comes to a chosen texel, opaque or not.

    codes (P, N, 2), texture (H, W, N, 4), chosen (H, W) bool.
    """
    found = np.zeros(codes.shape[0], np.float32)
    for p in prange(codes.shape[0]):
        found[p] = _light(p, codes, texture, chosen, min_light)
    return found


@compiled
def _light(p: Any, codes: Any, texture: Any, chosen: Any, min_light: Any) -> Any:
    transmittance = np.float32(1.0)
    for n in range(texture.shape[2]):
        if codes[p, n, 0] == 0:
            continue
        added, met = np.float32(0.0), False
        for tap in range(4):
            i, j, share = tap_share(codes, p, n, tap, texture)
            added += share
            met = met or (share > 0 and chosen[i, j])
        if met:
            return transmittance
        transmittance *= np.float32(1.0) - added
        if transmittance < min_light:
            break
    return np.float32(0.0)


@kernel(parallel=True)
def follow_step(  # type: ignore[no-untyped-def]
    own,  # (m,) int64, which texels move
    near,  # (n,) int64, all texels with a gradient
    colour,  # (M, 3)
    layers,  # (M, N, 4)
    frame_colour,  # (M, 3) of one frame, changed in place
    frame_alpha,  # (M, N)
    colour_moments,  # (2, m, 3)
    alpha_moments,  # (2, m, N)
    texture,  # (M, N, 4) as activated, and activated anew where texels move
    gradient,  # (N, M, 4) with respect to `texture`; zero afterwards
    rates,  # (2,) of colour and of alpha
    correct,  # (2,) bias corrections of both moments
    decay,  # (4,) of `adam.decays`
):
    """Adam on what one frame adds at some texels, and nothing else."""
    colours0, colours1 = colour_moments[0], colour_moments[1]
    alphas0, alphas1 = alpha_moments[0], alpha_moments[1]
    for q in prange(own.shape[0]):
        k = own[q]
        sum0, sum1, sum2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for n in range(gradient.shape[0]):
            sum0 += gradient[n, k, 0]
            sum1 += gradient[n, k, 1]
            sum2 += gradient[n, k, 2]
            alpha = texture[k, n, 3]
            g = gradient[n, k, 3] * alpha * (1 - alpha)
            frame_alpha[k, n] -= adam(alphas0, alphas1, (q, n), g, rates[1], correct[0], correct[1], decay)
        for c in range(3):
            g = sum0 if c == 0 else (sum1 if c == 1 else sum2)
            frame_colour[k, c] -= adam(colours0, colours1, (q, c), g, rates[0], correct[0], correct[1], decay)
        activate_texel(k, colour, layers, frame_colour, frame_alpha, texture)
    for q in prange(near.shape[0]):
        for n in range(gradient.shape[0]):
            for c in range(4):
                gradient[n, near[q], c] = 0
