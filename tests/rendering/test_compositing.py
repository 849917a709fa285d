"""Compositing in numpy against torch."""

from __future__ import annotations

import numpy as np
import torch

from facefolds_core.model.compositing import compositing_weights
from facefolds_core.rendering.compositing import transmittance_before


def test_numpy_agrees_with_torch() -> None:
    alpha = np.random.default_rng(0).uniform(0, 1, (50, 6)).astype(np.float32)
    alpha[3, 2], alpha[4] = 1, 0
    expected = compositing_weights(torch.from_numpy(alpha))[0].numpy()  # multiplied up in double precision
    for axis, layers, wanted in ((-1, alpha, expected), (0, alpha.T, expected.T)):
        before = transmittance_before(layers, axis)
        assert before.shape == layers.shape and before.dtype == np.float32
        np.testing.assert_allclose(before * layers, wanted, rtol=1e-6, atol=1e-7)
