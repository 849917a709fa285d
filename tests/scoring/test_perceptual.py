"""LPIPS and ST-LPIPS: what is found on the machine, and what it answers."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from facefolds_core.scoring.perceptual import (
    LPIPS_LINEAR,
    MIN_SIDE,
    TRUNK_NAME,
    PerceptualDistance,
    find_perceptual,
    load_lpips,
    load_st_lpips,
    lpips_from,
)

TRUNK = {
    **{0: (64, 3, 11, 4, 2), 3: (192, 64, 5, 1, 2), 6: (384, 192, 3, 1, 1)},
    **{8: (256, 384, 3, 1, 1), 10: (256, 256, 3, 1, 1)},
}
"""AlexNet as torchvision numbers it: channels out and in, side of the kernel, stride, padding."""


@pytest.fixture(scope="module")
def st_lpips() -> PerceptualDistance:
    metric = load_st_lpips()
    if metric is None:
        pytest.skip("the package stlpips-pytorch, whose weight file ST-LPIPS needs, is not installed")
    return metric


def picture(height: int = 80, width: int = 72, seed: int = 0) -> Tensor:
    """A reproducible smooth picture [3, H, W] in [0, 1]; by numpy, whose generator is the same with any torch."""
    y, x = np.meshgrid(np.arange(height), np.arange(width), indexing="ij")
    phase = np.random.default_rng(seed).uniform(0, 6, 3)
    waves = np.stack([np.sin(x / 5 + phase[0]), np.sin(y / 7 + phase[1]), np.sin((x + y) / 9 + phase[2])])
    return torch.tensor(0.5 + 0.4 * waves, dtype=torch.float32)


def noisy(image: Tensor, deviation: float) -> Tensor:
    noise = np.random.default_rng(1).normal(0, deviation, tuple(image.shape))
    return (image + torch.tensor(noise, dtype=torch.float32)).clamp(0, 1)


def random_trunk() -> dict[str, Tensor]:
    generator = torch.Generator().manual_seed(0)
    state: dict[str, Tensor] = {}
    for i, (out, into, side, _, _) in TRUNK.items():
        state[f"features.{i}.weight"] = torch.randn(out, into, side, side, generator=generator) / (side * into**0.5)
        state[f"features.{i}.bias"] = torch.zeros(out)
    return state


def test_more_noise_is_farther_away(st_lpips: PerceptualDistance) -> None:
    """And the same picture at no distance."""
    assert float(st_lpips(picture()[None], picture())) == 0
    images = torch.stack([noisy(picture(), deviation) for deviation in (0.02, 0.05, 0.1, 0.2, 0.4)])
    assert (st_lpips(images, picture()).diff() > 0).all()


def test_images_are_scored_one_by_one(st_lpips: PerceptualDistance) -> None:
    images = torch.stack([noisy(picture(), 0.1), noisy(picture(), 0.2)])
    together = st_lpips(images, picture())
    apart = [float(st_lpips(image[None], picture())) for image in images]
    np.testing.assert_allclose(together, apart, rtol=1e-6)


def test_a_shift_by_a_pixel_is_nearer_than_noise_of_equal_error(st_lpips: PerceptualDistance) -> None:
    """What the metric is for."""
    wide = picture(80, 73)
    truth, shifted = wide[..., :-1], wide[..., 1:]
    rms = float((shifted - truth).square().mean().sqrt())
    distances = st_lpips(torch.stack([shifted, noisy(truth, rms)]), truth)
    assert distances[0] < 0.5 * distances[1]


def test_the_value_of_the_published_implementation(st_lpips: PerceptualDistance) -> None:
    """Values of stlpips-pytorch 0.0.2 itself, run once on the same pictures."""
    expected = {0.05: 0.0454273, 0.2: 0.5826937}
    found = [float(st_lpips(noisy(picture(), deviation)[None], picture())) for deviation in expected]
    np.testing.assert_allclose(found, list(expected.values()), rtol=1e-4)


@pytest.mark.parametrize("size", [(1, 1), (8, 20), (MIN_SIDE - 1, MIN_SIDE)])
def test_small_images_are_enlarged(st_lpips: PerceptualDistance, size: tuple[int, int]) -> None:
    distance = st_lpips(torch.ones(1, 3, *size), torch.zeros(3, *size))
    assert 0 < float(distance) < 10


def test_lpips_without_the_published_trunk_is_not_reported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TORCH_HOME", str(tmp_path))
    found = find_perceptual()
    assert found.lpips is None
    assert any(TRUNK_NAME in line for line in found.missing)
    path = tmp_path / "hub" / "checkpoints" / TRUNK_NAME
    path.parent.mkdir(parents=True)
    torch.save(random_trunk(), path)
    assert load_lpips() is None


def test_lpips_puts_trunk_and_linear_weights_together() -> None:
    """The stages by hand, on a random trunk: LPIPS as its paper's eq. 1."""
    spec = importlib.util.find_spec(LPIPS_LINEAR[0])
    assert spec is not None and spec.submodule_search_locations is not None
    weights = Path(spec.submodule_search_locations[0]) / LPIPS_LINEAR[1]
    linear = torch.load(weights, map_location="cpu", weights_only=True)
    trunk = random_trunk()
    truth, image = picture(), noisy(picture(), 0.2)

    def features(x: Tensor) -> list[Tensor]:
        mean, deviation = torch.tensor([[-0.030, -0.088, -0.188], [0.458, 0.448, 0.450]])[..., None, None]
        found, f = [], ((2 * x - 1 - mean) / deviation)[None]
        for i, (*_, stride, padding) in TRUNK.items():
            f = torch.max_pool2d(f, 3, 2) if i in (3, 6) else f
            f = torch.conv2d(f, trunk[f"features.{i}.weight"], trunk[f"features.{i}.bias"], stride, padding).relu()
            found.append(f / (f.norm(dim=1, keepdim=True) + 1e-10))
        return found

    expected = 0.0
    for i, (f, g) in enumerate(zip(features(image), features(truth), strict=True)):
        weight = linear[f"lin{i}.model.1.weight"]
        expected += float((weight * (f - g) ** 2).sum(1).mean())
    assert float(lpips_from(trunk, linear)(image[None], truth)) == pytest.approx(expected, rel=1e-5)
