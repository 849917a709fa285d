"""PSNR and SSIM against closed forms and torchmetrics; SSIM of high frequencies."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch
from torchmetrics.functional.image import peak_signal_noise_ratio, structural_similarity_index_measure

from facefolds_core.scoring.metrics import MAX_PSNR, psnr, shown, ssim, ssim_high, ssim_map


def pair(height: int = 24, width: int = 31, noise: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """A smooth picture and a noisy copy, (H, W, 3) in [0, 1]."""
    rng = np.random.default_rng(0)
    y, x = np.meshgrid(np.arange(height), np.arange(width), indexing="ij")
    truth = 0.5 + 0.4 * np.sin(np.stack([x / 3, y / 4, (x + y) / 5], -1))
    return np.clip(truth + rng.normal(0, noise, truth.shape), 0, 1), truth


def channels_first(image: np.ndarray) -> torch.Tensor:
    return torch.tensor(image).permute(2, 0, 1)[None]


def test_psnr_of_an_offset_counts_masked_pixels_by_their_weight() -> None:
    truth = np.full((8, 9, 3), 0.5)
    assert psnr(truth + 0.1, truth) == pytest.approx(20)
    truth = np.zeros((2, 1, 3))
    image = truth + np.array([0.1, 0.3])[:, None, None]
    mask = np.array([[1.0], [0.25]])
    expected = -10 * math.log10((0.01 + 0.25 * 0.09) / 1.25)
    assert psnr(image, truth, mask) == pytest.approx(expected)


@pytest.mark.parametrize(("metric", "best"), [(psnr, MAX_PSNR), (ssim, 1), (ssim_high, 1)])
def test_masks_hide_and_what_is_the_same_is_perfect(metric: Callable[..., float | None], best: float) -> None:
    image, truth = pair(64, 64)
    ones, upper = np.ones(truth.shape[:2]), np.zeros(truth.shape[:2])
    upper[:32] = 1
    changed = image.copy()
    changed[32:] = 1 - changed[32:]
    assert metric(truth, truth) == pytest.approx(best, abs=1e-12)
    assert metric(image, truth, ones) == pytest.approx(metric(image, truth), abs=1e-12)
    assert metric(changed, truth, upper) == metric(image, truth, upper)
    assert metric(image, truth, 0 * ones) is None


@pytest.mark.parametrize("noise", [0.01, 0.1, 0.5])
def test_both_agree_with_torchmetrics(noise: float) -> None:
    image, truth = pair(noise=noise)
    pictures = channels_first(image), channels_first(truth)
    expected = float(structural_similarity_index_measure(*pictures, data_range=1.0))
    assert ssim(image, truth) == pytest.approx(expected, abs=1e-7)
    expected = float(peak_signal_noise_ratio(*pictures, data_range=1.0))
    assert psnr(image, truth) == pytest.approx(expected, abs=1e-5)  # theirs is float32: 1e-6 apart


def test_ssim_of_two_flat_images_is_their_luminance_term() -> None:
    a, b = 0.3, 0.7
    expected = (2 * a * b + 1e-4) / (a**2 + b**2 + 1e-4)
    assert ssim(np.full((16, 16, 3), a), np.full((16, 16, 3), b)) == pytest.approx(expected, abs=1e-9)
    small = ssim_map(*pair(3, 2))  # smaller than its window
    assert small.shape == (3, 2) and np.isfinite(small).all()


def test_ssim_of_high_frequencies_ignores_what_a_wide_blur_keeps() -> None:
    """A shift and a slope of brightness are low frequencies; waves of four pixels are not."""
    _, truth = pair(64, 64)
    x = np.arange(64)
    slope = (0.002 * x)[None, :, None]
    waves = 0.1 * np.sin(np.pi * x / 2)[None, :, None]
    smooth, wavy = ssim_high(truth + 0.1 + slope, truth), ssim_high(truth + waves, truth)
    assert smooth is not None and smooth > 0.999
    assert wavy is not None and wavy < 0.6


def test_shown_clips_and_rounds_to_eight_bits() -> None:
    np.testing.assert_array_equal(shown(np.array([-0.2, 1.3, 100.4 / 255, 100.6 / 255])) * 255, [0, 255, 100, 101])
