"""Compiled kernels of the explicit model against their torch references, values and gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.ndimage import uniform_filter

from facefolds_core.geometry.sphere_uv import st_to_uv
from facefolds_core.kernels import scatter
from facefolds_core.kernels.adam import decays
from facefolds_core.model.grids import GridTextures
from facefolds_core.training.explicit import adam_kernel, shading_kernel
from facefolds_core.training.explicit.adam_kernel import smooth
from facefolds_core.training.explicit.rates import BETAS
from facefolds_core.training.explicit.state import MIN_ALPHA, MIN_LIGHT
from tests.threads import each_of
from tests.training import reference

WINDOW = (-0.5, 0.4, -0.3, 0.6)


def random_cut(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """(*shape, 4) uint8: colours times opacity, and opacity."""
    alpha = rng.integers(0, 256, (*shape, 1))
    return np.concatenate([rng.random((*shape, 3)) * alpha, alpha], -1).astype(np.uint8)


def _problem(rays: int, layers: int, shape: tuple[int, int]) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    codes = rng.integers(1, 65536, (rays, layers, 2)).astype(np.uint16)
    codes[rng.random((rays, layers)) < 0.2] = 0
    texture = rng.random((*shape, layers, 4), np.float32)
    texture[..., 3] *= 0.5
    finer = rng.integers(1, 65536, (rays // 3, 4, layers, 2)).astype(np.uint16)
    finer[rng.random((rays // 3, 4, layers)) < 0.2] = 0
    which = rng.permutation(np.r_[np.arange(rays // 3), np.full(rays - rays // 3, -1)]).astype(np.int32)
    return {
        "codes": codes,
        "finer": finer,
        "which": which,
        "camera": np.zeros(rays, np.int32),
        "pixel": np.arange(rays, dtype=np.int32),
        "rays": np.arange(rays),
        "cut": random_cut(rng, (1, rays)),
        "behind": rng.random((1, 4), np.float32),
        "texture": texture,
        "shine": rng.random((rays, 3), np.float32) * 0.4 - 0.2,
    }


def _shaded(p: dict[str, np.ndarray], *settings: object) -> tuple[np.ndarray, float]:
    """What the kernel adds to nothing, (H, W, N, 4), and what it returns."""
    height, width, layers, _ = p["texture"].shape
    sums = np.zeros((layers, height, width, 4), np.float32)
    squares = shading_kernel.shade(*p.values(), sums, *settings)
    return sums.transpose(1, 2, 0, 3), squares


SETTINGS = {"rounds of geometry": (0.0, MIN_LIGHT), "textures": (MIN_ALPHA, MIN_LIGHT), "stronger": (0.05, 0.1)}
"""What is faint, what is hidden: as in production, and one that shows."""


@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize("rays, layers, shape", [(1, 1, (2, 2)), (300, 3, (7, 5)), (1000, 12, (16, 24))])
def test_shading_matches_autograd(rays: int, layers: int, shape: tuple[int, int], setting: str) -> None:
    """With the settings of `fast`, and alphas of which a third is faint: what a GPU trains is what a CPU trains."""
    p = _problem(rays, layers, shape)
    p["texture"][..., 3] *= np.random.default_rng(1).choice([0.003, 0.3, 1.9], (*shape, layers))
    gradient, squares = _shaded(p, *SETTINGS[setting], False)
    expected, total = reference.shade(*_in_torch(p), *SETTINGS[setting])
    # Worst seen 1.4e-6 of gradients up to 2.3; 1.8 by a reference that does not leave out what is faint.
    torch.testing.assert_close(torch.from_numpy(gradient), expected, atol=1e-5, rtol=0)
    assert squares == pytest.approx(float(total), rel=1e-5)  # seen: 4e-7


@pytest.mark.parametrize("least", [MIN_LIGHT, 0.3])
def test_errors_by_texel_match_autograd(least: float) -> None:
    p = _problem(600, 4, (9, 7))
    expected = reference.errors_by_texel(*_in_torch(p), least)
    torch.testing.assert_close(torch.from_numpy(_shaded(p, 0.0, least, True)[0]), expected, atol=2e-5, rtol=0)


def test_what_is_cut_out_needs_no_layers_where_it_is_clear() -> None:
    """A pixel beside the subject has the colour behind: no layer explains it, and each is asked to go, at a price."""
    p = _problem(50, 3, (6, 6))
    p["cut"][:], p["texture"][..., 3] = 0, 0
    gradient, squares = _shaded(p, 0.0, MIN_LIGHT, False)
    assert squares == pytest.approx(0, abs=1e-9)
    assert np.abs(gradient[..., :3]).max() < 1e-5
    assert gradient[..., 3].min() >= 0
    met = (p["codes"][p["which"] < 0, :, 0] > 0).sum() + (p["finer"][..., 0] > 0).sum() / 4
    assert gradient[..., 3].sum() == pytest.approx(shading_kernel.PRICE * met, rel=1e-4)


def _in_torch(p: dict[str, np.ndarray]) -> list[torch.Tensor]:
    """As the references take a problem whose rays are all of one camera: codes, of, cut, behind, texture, shine."""
    pixels, single = p["pixel"].shape[0], np.flatnonzero(p["which"] < 0)
    finer = np.argsort(p["which"], kind="stable")[len(single) :]
    codes = np.concatenate([p["codes"][single], p["finer"].reshape(-1, *p["codes"].shape[1:])]).astype(np.int32)
    of = np.concatenate([single, finer.repeat(4)])
    cut, behind = p["cut"][0] / np.float32(255), p["behind"].repeat(pixels, 0)
    return [torch.from_numpy(x) for x in (codes, of, cut, behind, p["texture"], p["shine"])]


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_shading_at_extreme_alphas(alpha: float) -> None:
    p = _problem(50, 4, (6, 6))
    p["texture"][..., 3] = alpha
    assert all(np.isfinite(found).all() for found in _shaded(p, 0.0, MIN_LIGHT, False))


def test_shading_does_not_depend_on_the_number_of_threads() -> None:
    p = _problem(2 * scatter.CHUNK + 1000, 6, (9, 9))
    first, *others = each_of((1, 2, 4), lambda: _shaded(p, 0.0, MIN_LIGHT, False))
    for other in others:
        for a, b in zip(first, other, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("layers", range(1, 20))
def test_every_layer_is_somebodys_task(layers: int) -> None:
    assert sorted(scatter.spread(task, layers) for task in range(layers)) == list(range(layers))


@pytest.mark.parametrize("betas", [BETAS, (0.5, 0.7)])
def test_adam_step_matches_the_reference(betas: tuple[float, float]) -> None:
    torch.manual_seed(0)
    m, n = 40, 5
    parts = [torch.randn(3, m, 3), torch.randn(3, m, n, 4), torch.randn(3, m, 3), torch.randn(3, m, n)]
    for part in parts:
        part[2].abs_()
    parts[0][0].clamp_(0, 1)
    gradient = torch.randn(m, n, 4)
    gradient[torch.rand(m, n) < 0.4] = 0
    gradient[:5] = 0
    texture = reference.activate(*(p[0] for p in parts))
    out = np.empty((m, n, 4), np.float32)
    adam_kernel.activate(*(p[0].numpy() for p in parts), out)
    torch.testing.assert_close(torch.from_numpy(out), texture, atol=1e-6, rtol=0)
    rates = torch.tensor([0.02, 0.006, 0.3, 0.01, 0.15])
    correct = torch.tensor([1.5, 2.0, 4.0, 6.0])
    compiled = [p.clone() for p in parts]
    pushed = gradient.permute(1, 0, 2).contiguous().numpy()
    given = *(p.numpy() for p in compiled), texture.numpy(), pushed, rates.numpy(), correct.numpy()
    adam_kernel.adam_step(*given, decays(betas))
    reference.adam_step(*parts, texture, gradient, rates, correct, betas)
    for a, b in zip(compiled, parts, strict=True):
        torch.testing.assert_close(a, b, atol=1e-5, rtol=1e-4)


@pytest.mark.parametrize("shape", [(2, 2), (5, 3), (16, 24)])
def test_smoothing_is_the_mean_over_nine_texels(shape: tuple[int, int]) -> None:
    values = np.random.default_rng(0).normal(size=(shape[0] * shape[1], 3)).astype(np.float32)
    given = values.copy()
    smoothed = smooth(values, *shape)
    np.testing.assert_array_equal(values, given)
    expected = uniform_filter(values.reshape(*shape, 3), (3, 3, 1), mode="nearest")
    np.testing.assert_allclose(smoothed.reshape(*shape, 3), expected, atol=1e-6)


def test_kernel_and_model_sample_the_same_texture() -> None:
    """Stored 16-bit positions and the model's (u, v) meet the same texels."""
    rng = np.random.default_rng(3)
    textures = GridTextures(WINDOW, (12, 9), 2, 3)
    with torch.no_grad():
        for parameter in textures.parameters():
            parameter.copy_(torch.from_numpy(rng.normal(0.3, 0.3, parameter.shape)))
    st = torch.from_numpy(rng.random((200, 2)))
    codes = (1 + 65534 * st).round().to(torch.int32)[:, None].expand(-1, 2, -1)
    flat = [x.detach().flatten(0, 1) for x in (textures.colour, textures.layers)]
    flat += [x.detach()[1].flatten(0, 1) for x in (textures.frame_colour, textures.frame_alpha)]
    rgba = reference.look_up(codes, reference.activate(*flat).view(12, 9, 2, 4))
    for layer in range(2):
        where = torch.full((200,), layer)
        shaded = textures.shade(st_to_uv(st, WINDOW), where, torch.ones(200), None)
        torch.testing.assert_close(shaded.rgb.float(), rgba[:, layer, :3], atol=1e-3, rtol=0)
        torch.testing.assert_close(shaded.alpha.float(), rgba[:, layer, 3], atol=1e-3, rtol=0)


def test_textures_interpolate_in_time() -> None:
    textures = GridTextures(WINDOW, (4, 4), 1, 2)
    with torch.no_grad():
        textures.colour.fill_(0.2)
        textures.frame_colour[1].fill_(0.4)
    uv, layer = torch.zeros(1, 2), torch.zeros(1, dtype=torch.int64)
    values = [textures.shade(uv, layer, torch.tensor([t]), None).rgb[0, 0].item() for t in (0.0, 0.25, 1.0, 7.0)]
    assert values == pytest.approx([0.2, 0.3, 0.6, 0.6])
