"""Explicit textures: one layer's image against the general look-up."""

from __future__ import annotations

import pytest
import torch

from facefolds_core.model.grids import GridTextures

WINDOW = (-0.5, 0.4, -0.3, 0.6)


def random_textures(shape: tuple[int, int] = (12, 9)) -> GridTextures:
    textures = GridTextures(WINDOW, shape, 2, 3)
    generator = torch.Generator().manual_seed(0)
    with torch.no_grad():
        for parameter in textures.parameters():
            parameter.copy_(torch.randn(parameter.shape, generator=generator))
    return textures


@pytest.mark.parametrize("time", [-1.0, 0.0, 0.3, 2.0, 5.0])
@pytest.mark.parametrize("layer", [0, 1])
def test_a_sheet_is_what_shade_gives(layer: int, time: float) -> None:
    """Worst difference seen 5e-7: the order of the sums differs."""
    textures = random_textures()
    uv = torch.rand(300, 2, generator=torch.Generator().manual_seed(1)) * 1.2 - 0.6  # beyond the window too
    sheet = textures.sheet(uv, layer, time)
    layers, times = torch.full((300,), layer), torch.full((300,), time)
    other = torch.where(torch.arange(300) < 299, times, time + 0.5)  # not one time
    for shaded in (textures.shade(uv, layers, times, None), textures.shade(uv, layers, other, None)):
        torch.testing.assert_close(sheet.rgb[:299], shaded.rgb[:299], atol=1e-5, rtol=0)
        torch.testing.assert_close(sheet.alpha[:299], shaded.alpha[:299], atol=1e-5, rtol=0)


@pytest.mark.parametrize("frame", [0, 1, 2])
def test_at_a_frames_time_it_shows_that_frame_and_nothing_of_others(frame: int) -> None:
    textures = random_textures()
    alone = GridTextures(WINDOW, textures.shape, 2, 1)
    with torch.no_grad():
        alone.colour.copy_(textures.colour)
        alone.layers.copy_(textures.layers)
        alone.frame_colour.copy_(textures.frame_colour[frame : frame + 1])
        alone.frame_alpha.copy_(textures.frame_alpha[frame : frame + 1])
    for layer in range(2):
        torch.testing.assert_close(textures.image(layer, float(frame)), alone.image(layer, 0.0), atol=0, rtol=0)
