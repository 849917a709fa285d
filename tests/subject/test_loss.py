"""The loss's gradient against autograd, its SSIM against the scores'."""

from __future__ import annotations

import numpy as np

from facefolds_core.scoring.metrics import ssim
from facefolds_core.subject.loss import ssim_gradient


def test_gradient_of_ssim() -> None:
    random = np.random.default_rng(0)
    x, y = random.random((2, 24, 30)).astype(np.float32)
    gradient = ssim_gradient(x, y)
    for i, j in ((12, 15), (9, 20)):  # at the border the mirrored part is not differentiated
        values = []
        for step in (-0.01, 0.01):
            moved = x.copy()
            moved[i, j] += step
            three = [np.repeat(part[..., None], 3, -1).astype(np.float64) for part in (moved, y)]
            value = ssim(*three)
            assert value is not None
            values.append(value * x.size)
        slope = (values[1] - values[0]) / 0.02
        assert abs(gradient[i, j] - slope) < 0.02 * abs(slope) + 2e-3, (i, j)
