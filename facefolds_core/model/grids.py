"""Explicit textures: colour and opacity on texel grids over the window of the radius maps."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import grid_sample

from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window, uv_to_st
from facefolds_core.model.reflection import Reflection
from facefolds_core.model.textures import Shaded, TexelGrid


class GridTextures(nn.Module):
    """RGBA of N layers and K frames on H x W texels; texel centres as in `geometry.sphere_uv`.

    At a texel, colour of layer n at frame k = clamp(colour + layers[n, :3] + frame_colour[k], 0, 1) and
    alpha = sigmoid(layers[n, 3] + frame_alpha[k, n]). Between texels the results are interpolated (as a GPU samples
    the exported texture); between frames the sums are, before clamp and sigmoid. Nearly all colour is shared by the
    layers, which therefore cannot paint a different picture each for the cameras that see them at different angles.

    Attributes:
        colour: [H, W, 3].
        layers: [H, W, N, 4]: colour added by a layer, logit of its alpha.
        frame_colour: [K, H, W, 3].
        frame_alpha: [K, H, W, N], added to the logit.

    A reflection, where there is one, is added by `shade` for the directions that it is given.

    Args:
        window: (u0, u1, v0, v1).
        shape: (H, W).
        num_layers, num_frames: N and K.
        reflection: shared by layers and frames, or None.
    """

    def __init__(
        self,
        window: Window,
        shape: tuple[int, int],
        num_layers: int,
        num_frames: int,
        reflection: Reflection | None = None,
    ) -> None:
        super().__init__()
        self.window = window
        h, w = shape
        self.colour = nn.Parameter(torch.zeros(h, w, 3))
        self.layers = nn.Parameter(torch.zeros(h, w, num_layers, 4))
        self.frame_colour = nn.Parameter(torch.zeros(num_frames, h, w, 3))
        self.frame_alpha = nn.Parameter(torch.zeros(num_frames, h, w, num_layers))
        self.reflection = reflection

    @property
    def num_frames(self) -> int:
        return len(self.frame_alpha)

    def reflection_maps(self) -> ReflectionMaps | None:
        """The reflection, as an asset has it."""
        return None if self.reflection is None else self.reflection.maps(self.window)

    @property
    def shape(self) -> tuple[int, int]:
        return self.colour.shape[0], self.colour.shape[1]

    def texel_grid(self) -> TexelGrid:
        """The texels themselves."""
        return TexelGrid(self.window, self.shape)

    def frame(self, index: int) -> tuple[Tensor, Tensor]:
        """What frame `index` adds: colour [H, W, 3], and to the logits of alpha [H, W, N]."""
        return self.frame_colour[index], self.frame_alpha[index]

    def image(self, layer: int, time: float) -> Tensor:
        """RGBA [H, W, 4] of one layer at one time, at the texels."""
        time = min(max(float(time), 0.0), self.num_frames - 1.0)
        before = int(time)
        after, fraction = min(before + 1, self.num_frames - 1), time - before
        own = self.layers[:, :, layer]
        (colour_0, alpha_0), (colour_1, alpha_1) = self.frame(before), self.frame(after)
        moving = torch.lerp(colour_0, colour_1, fraction)
        fading = torch.lerp(alpha_0[..., layer], alpha_1[..., layer], fraction)
        rgb = (self.colour + own[..., :3] + moving).clamp(0, 1)
        return torch.cat([rgb, torch.sigmoid(own[..., 3:] + fading[..., None])], -1)

    def sheet(self, uv: Tensor, layer: int, time: float) -> Shaded:
        """Points at uv [P, 2] of one layer at one time; its image is made once and sampled."""
        at = uv_to_st(uv, self.window) * 2 - 1
        image = self.image(layer, time).permute(2, 0, 1)[None]
        rgba = grid_sample(image, at[None, None], mode="bilinear", padding_mode="border", align_corners=False)
        rgba = rgba[0, :, 0].T
        return Shaded(rgba[:, :3], rgba[:, 3], None)

    def shade(self, uv: Tensor, layer: Tensor, time: Tensor, directions: Tensor | None) -> Shaded:
        """Points at uv [P, 2] of layers [P] at frame times [P]; the view term is the reflection's [P, 3].

        Images of all layers are made for each time that occurs, which are few: a picture has one.
        """
        height, width = self.shape
        st = uv_to_st(uv, self.window)
        x = (st[:, 0] * width - 0.5).clamp(0, width - 1)
        y = (st[:, 1] * height - 0.5).clamp(0, height - 1)
        j, i = x.floor().clamp(max=max(width - 2, 0)).long(), y.floor().clamp(max=max(height - 2, 0)).long()
        b, a = (x - j)[:, None], (y - i)[:, None]
        times, which = time.unique(return_inverse=True)
        images = [self.image(n, at) for at in times.tolist() for n in range(self.layers.shape[2])]
        texels = torch.stack(images) if images else self.layers.new_zeros(1, height, width, 4)
        number = which * self.layers.shape[2] + layer
        rgba = torch.zeros_like(b)
        for di, wi in ((0, 1 - a), (1, a)):
            for dj, wj in ((0, 1 - b), (1, b)):
                texel = texels[number, (i + di).clamp(max=height - 1), (j + dj).clamp(max=width - 1)]
                rgba = rgba + wi * wj * texel
        seen = None if directions is None or self.reflection is None else self.reflection.added(st, directions)
        return Shaded(rgba[:, :3], rgba[:, 3], seen)
