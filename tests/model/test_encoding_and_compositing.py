"""Positional encoding and compositing against closed forms and at extreme values."""

import math

import pytest
import torch

from facefolds_core.model.compositing import compositing_weights
from facefolds_core.model.textures import encoded_size, positional_encoding


def test_encoding_closed_form() -> None:
    x = torch.tensor([[0.25, -0.5]], dtype=torch.float64)
    expected = [0.25, -0.5]
    for wave in (math.sin, math.cos):
        expected += [wave(math.pi * 2**k * value) for value in (0.25, -0.5) for k in range(3)]
    encoded = positional_encoding(x, 3)
    assert encoded.shape[-1] == encoded_size(2, 3)
    torch.testing.assert_close(encoded, torch.tensor([expected], dtype=torch.float64))
    assert torch.equal(positional_encoding(x, 0), x)


def test_weights_closed_form() -> None:
    a = torch.tensor([[0.5, 0.25, 0.8]], dtype=torch.float64)
    weights, transmittance = compositing_weights(a)
    expected = torch.tensor([[0.5, 0.5 * 0.25, 0.5 * 0.75 * 0.8]], dtype=torch.float64)
    torch.testing.assert_close(weights, expected)
    torch.testing.assert_close(transmittance, torch.tensor([0.5 * 0.75 * 0.2], dtype=torch.float64))
    alpha = torch.rand(100, 12, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    weights, transmittance = compositing_weights(alpha)
    torch.testing.assert_close(weights.sum(-1) + transmittance, torch.ones(100, dtype=torch.float64))


@pytest.mark.parametrize("values", [(0, 0, 0), (1, 1, 1), (1e-30, 1, 1e-30), (1, 0, 1), (1 - 1e-7, 1e-30, 0)])
def test_extreme_alphas_have_finite_values_and_gradients(values: tuple[float, ...]) -> None:
    alpha = torch.tensor([values], dtype=torch.float32, requires_grad=True)
    weights, transmittance = compositing_weights(alpha)
    (weights * torch.arange(1, 4)).sum().add(transmittance.sum()).backward()
    assert weights.isfinite().all() and transmittance.isfinite().all()
    assert alpha.grad is not None and alpha.grad.isfinite().all()


def test_gradient_at_opaque_layers_closed_form() -> None:
    # L = w_1 + 2 w_2 with alpha = (1, 1): dL/da_1 = 1 - 2 a_2, dL/da_2 = 2 (1 - a_1).
    alpha = torch.tensor([[1.0, 1.0]], requires_grad=True)
    weights, _ = compositing_weights(alpha)
    (weights * torch.tensor([1.0, 2.0])).sum().backward()
    assert alpha.grad is not None and alpha.grad.tolist() == [[-1.0, 0.0]]
