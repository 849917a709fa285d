"""Compositing in numpy, layer by layer and at once, against torch."""

from __future__ import annotations

import numpy as np
import torch

from facefolds_core.model.compositing import compositing_weights
from facefolds_core.rendering.compositing import FrontToBack, transmittance_before


def test_all_forms_agree() -> None:
    alpha = np.random.default_rng(0).uniform(0, 1, (50, 6)).astype(np.float32)
    alpha[3, 2], alpha[4] = 1, 0
    light = FrontToBack(50)
    weights = np.stack([light.add(np.ones(50, bool), alpha[:, i]) for i in range(6)], -1)
    expected, behind = compositing_weights(torch.from_numpy(alpha))
    # torch multiplies up in double precision; the forms in numpy are equal to the last bit.
    np.testing.assert_allclose(weights, expected.numpy(), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(light.transmittance, behind.numpy(), rtol=1e-6, atol=1e-7)
    for axis, layers in ((-1, alpha), (0, alpha.T)):
        before = transmittance_before(layers, axis)
        assert before.shape == layers.shape and before.dtype == np.float32
        np.testing.assert_array_equal(before * layers, weights if axis else weights.T)


def test_a_layer_counts_where_it_is_hit() -> None:
    light = FrontToBack((1, 3))
    light.add(np.array([[True, False, True]]), np.float32([0.5, 1]))
    assert light.transmittance.tolist() == [[0.5, 1, 0]]
    assert light.add(np.array([[True, True, True]]), np.float32([0.5, 0.5, 0.5])).tolist() == [0.25, 0.5, 0]
