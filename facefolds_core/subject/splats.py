"""Gaussians in space that explain the pictures of one frame, room included (Kerbl et al. 2023).

All numbers of a Gaussian stand in one row, so that kernels and Adam walk through one array:

| columns | of | meaning |
|---|---|---|
| 0:3 | `MEAN` | position, units of the normalised world |
| 3:6 | `SCALE` | logarithms of the standard deviations along its own axes |
| 6:10 | `TURN` | quaternion w, x, y, z of its axes, of any length but 0 |
| 10 | `OPACITY` | logit of the largest opacity |
| 11:14 | `COLOUR` | RGB, 0 to 1 in stored values |
| 14:23 | `SHINE` | three times RGB: what is added along x, y and z of the unit direction from the camera |
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

MEAN, SCALE, TURN, COLOUR, SHINE = slice(0, 3), slice(3, 6), slice(6, 10), slice(11, 14), slice(14, 23)
OPACITY = 10
COLUMNS = 23


def longest_axes(values: Array) -> Array:
    """(n, 3) along the longest axes of Gaussians (n, COLUMNS), one standard deviation long."""
    return axes_of(values)[:, 0]


def axes_of(values: Array) -> Array:
    """(n, 3, 3) the axes of Gaussians (n, COLUMNS), one standard deviation long, the longest first."""
    w, x, y, z = (values[:, TURN] / np.linalg.norm(values[:, TURN], axis=1, keepdims=True)).T
    columns = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    rows, order = np.arange(len(values))[:, None], np.argsort(-values[:, SCALE], 1, kind="stable")
    axes = np.array(columns).transpose(2, 0, 1)[rows, order]
    return np.asarray(axes * np.exp(values[:, SCALE][rows, order])[..., None], np.float32)


@dataclass(frozen=True)
class Splats:
    """N Gaussians and what is behind all of them.

    Attributes:
        values: (N, COLUMNS) float32, see above.
        background: (3,) float32 RGB, behind everything.
    """

    values: Array
    background: Array

    def __len__(self) -> int:
        return len(self.values)

    @property
    def means(self) -> Array:
        """(N, 3) units."""
        return self.values[:, MEAN]

    @property
    def sizes(self) -> Array:
        """(N, 3) standard deviations, units."""
        return np.exp(self.values[:, SCALE])

    @property
    def opacities(self) -> Array:
        """(N,) in [0, 1]."""
        return np.asarray(1 / (1 + np.exp(-self.values[:, OPACITY])), np.float32)

    @property
    def colours(self) -> Array:
        """(N, 3) RGB without what depends on the direction."""
        return self.values[:, COLOUR]

    def part(self, chosen: NDArray[Any]) -> Splats:
        """Some of them: (N,) bool or indices."""
        return replace(self, values=self.values[chosen])
