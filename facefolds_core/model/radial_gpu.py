"""First crossings of rays with radius maps, on GPUs: the body of `radial_kernel`."""

# numba has no types:
# mypy: disable-error-code="no-untyped-def,attr-defined"

from __future__ import annotations

from typing import Any

import numpy as np
from numba import cuda

from facefolds_core.kernels import gpu
from facefolds_core.kernels.gpu import entry
from facefolds_core.model.radial_kernel import cross

LAYERS = 1
"""N, given where an entry is run."""


@entry
def crossing_distances(offsets, directions, rho, window, belt, ceiling, bound, step, result):
    ray = cuda.grid(1)
    if ray < result.shape[0]:
        one = cuda.local.array(LAYERS, np.float64)
        other = cuda.local.array(LAYERS, np.float64)
        cross(ray, offsets, directions, rho, window, belt, ceiling, bound, step, result, one, other)


class Tracer:
    """`radial_kernel.crossing_distances` with surfaces that stay on the GPU; its arguments are that function's."""

    def __init__(
        self, rho: gpu.Array, window: gpu.Array, belt: gpu.Array, ceiling: gpu.Array, bound: float, step: float
    ) -> None:
        self._layers = int(rho.shape[2])
        self._surfaces: tuple[Any, ...] = (*(gpu.to_gpu(array) for array in (rho, window, belt, ceiling)), bound, step)

    def __call__(self, offsets: gpu.Array, directions: gpu.Array) -> gpu.Array:
        """(R, 3) float64 origins minus c, and directions -> (R, N) float32 distances, 0 where missed."""
        found = gpu.zeros((len(offsets), self._layers))
        rays = gpu.to_gpu(offsets), gpu.to_gpu(directions)
        crossing_distances.run(len(offsets), *rays, *self._surfaces, found, LAYERS=self._layers)
        distances: gpu.Array = found.copy_to_host()
        return distances
