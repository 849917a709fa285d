"""Entries of the texture steps' kernels on GPUs: the bodies of `shading_kernel`, `adam_kernel` and `smoothing`."""

# numba has no types:
# mypy: disable-error-code="no-untyped-def,attr-defined"

from __future__ import annotations

import numpy as np
from numba import cuda

from facefolds_core.kernels.gpu import entry
from facefolds_core.kernels.scatter import put_of
from facefolds_core.training.explicit.adam_kernel import activate_texel, adam_texel
from facefolds_core.training.explicit.shading_kernel import light_before, shade_pixel, tap_share
from facefolds_core.training.explicit.smoothing import column_sum, mean

LAYERS = SAMPLES = 1
"""N, and the most rays of a pixel, given where an entry is run."""

_put = put_of(4)


@entry
def shade(
    codes,  # as of `shading_kernel.shade`
    finer,
    which,
    camera,
    pixel,
    rays,
    cut,
    behind,
    texture,
    shine,
    gradient,
    terms,  # float32: min_alpha; float64: min_light; bool: shares
    squares,  # (S,) float64: sums of |C - I|^2 are added to them in turn
):
    k = cuda.grid(1)
    if k >= rays.shape[0]:
        return
    index = cuda.local.array((LAYERS, SAMPLES), np.int32)
    wish = cuda.local.array((LAYERS, SAMPLES, 6), np.float32)
    layer = cuda.local.array((SAMPLES, LAYERS), np.int64)
    count = cuda.local.array(SAMPLES, np.int64)
    c = cuda.local.array((SAMPLES, LAYERS, 4), np.float32)
    before = cuda.local.array((SAMPLES, LAYERS), np.float32)
    p = rays[k]
    own = codes[p : p + 1] if which[p] < 0 else finer[which[p]]
    square = shade_pixel(
        0,
        p,
        own,
        camera,
        pixel,
        cut,
        behind,
        texture,
        shine,
        terms,
        index,
        wish,
        (layer, count, c, before),
    )
    cuda.atomic.add(squares, k % squares.shape[0], square)
    for n in range(LAYERS):
        for s in range(own.shape[0]):
            if index[n, s] >= 0:
                _put(index[n, s], wish[n], s, gradient[n])


@entry
def contributions(codes, rays, texture, peak, min_light):
    k = cuda.grid(1)
    if k >= rays.shape[0]:
        return
    p = rays[k]
    before = cuda.local.array((LAYERS, 1), np.float32)
    light_before(0, p, codes, texture, before, min_light)
    for n in range(LAYERS):
        if codes[p, n, 0] == 0 or before[n, 0] == 0:
            continue
        for tap in range(4):
            i, j, share = tap_share(codes, p, n, tap, texture)
            cuda.atomic.max(peak, (n, i, j), before[n, 0] * share)


@entry
def activate(colour, layers, frame_colour, frame_alpha, out):
    k = cuda.grid(1)
    if k < layers.shape[0]:
        activate_texel(k, colour, layers, frame_colour, frame_alpha, out)


@entry
def adam_step(colour, layers, frame_colour, frame_alpha, texture, gradient, rates, keep, correct, decay):
    k = cuda.grid(1)
    if k < layers.shape[1]:
        static = (colour[0], colour[1], colour[2]), (layers[0], layers[1], layers[2])
        own = (
            (frame_colour[0], frame_colour[1], frame_colour[2]),
            (frame_alpha[0], frame_alpha[1], frame_alpha[2]),
        )
        adam_texel(k, static, own, texture, gradient, rates, keep, correct, decay)


@entry
def smooth(values, height, width, out):
    k = cuda.grid(1)
    if k >= out.shape[0]:
        return
    i, j = k // width, k % width
    left = cuda.local.array(LAYERS, np.float32)
    middle = cuda.local.array(LAYERS, np.float32)
    right = cuda.local.array(LAYERS, np.float32)
    column_sum(i, max(j - 1, 0), values, height, width, left)
    column_sum(i, j, values, height, width, middle)
    column_sum(i, min(j + 1, width - 1), values, height, width, right)
    mean(left, middle, right, out[k])


@entry
def go_towards(values, goal, share):
    k = cuda.grid(1)
    if k < values.shape[0]:
        for n in range(values.shape[1]):
            values[k, n] += share * (goal[k, n] - values[k, n])
