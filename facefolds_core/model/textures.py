"""What the layers look like: colour and opacity at (u, v) of a layer, at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import embedding, relu

from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.model.layers import LinearStack


@dataclass(frozen=True)
class Shaded:
    """Appearance of P points.

    Attributes:
        rgb: [P, 3] view-independent colour in [0, 1].
        alpha: [P] opacity in [0, 1].
        view: [P] grey view-dependent term to add to all three channels, [P, 3] a coloured one, or None where it was not
            asked for.
    """

    rgb: Tensor
    alpha: Tensor
    view: Tensor | None

    @property
    def added(self) -> Tensor | None:
        """`view` as [P, 1] or [P, 3]."""
        return self.view[:, None] if self.view is not None and self.view.dim() == 1 else self.view


@dataclass(frozen=True)
class TexelGrid:
    """Texels between which textures are bilinear: an image of `shape` (H, W) over `window`."""

    window: Window
    shape: tuple[int, int]


def positional_encoding(x: Tensor, octaves: int) -> Tensor:
    """NeRF's encoding with the input itself in front: (x, sin(2^k pi x), cos(2^k pi x)) for k = 0 .. octaves - 1.

    The paper says "positional encodings" only; this is the form of Mildenhall et al. 2020, eq. 4, with the raw input
    kept, as their code does.

    Args:
        x: [..., D], meant for values in [-1, 1].
        octaves: L; 0 returns x.

    Returns:
        [..., D (1 + 2 L)].
    """
    if octaves == 0:
        return x
    frequencies = math.pi * 2.0 ** torch.arange(octaves, dtype=x.dtype, device=x.device)
    phase = (x[..., None] * frequencies).flatten(-2)
    return torch.cat([x, phase.sin(), phase.cos()], -1)


def encoded_size(dimensions: int, octaves: int) -> int:
    """Length of `positional_encoding` of a vector of `dimensions`."""
    return dimensions * (1 + 2 * octaves)


TEXELS_AT_ONCE = 65_536
"""Points that `MlpTextures.sheet` works on together: bounds its memory."""


class MlpTextures(nn.Module):
    """The paper's texture predictor: an MLP on (encoded (u, v), encoded layer coordinate, frame latent), two branches.

    - Layer coordinate: s_i scaled to [-1, 1] (outermost 1), encoded with `level_frequencies` octaves.
    - Base branch (one linear layer): RGB and alpha, each through a sigmoid. The paper takes alpha as "the raw output",
      but alpha outside [0, 1] makes compositing blow up.
    - View branch (one linear layer on the last hidden layer and the encoded ray direction): one grey value, unbounded,
      added to RGB. Zero to start with.
    - Activation ReLU. Latents: normal, standard deviation 0.1.

    Args:
        num_layers: N.
        num_frames: K latents.
        hidden_layers, width: of the MLP.
        latent_dim: of each frame's latent.
        uv_frequencies, level_frequencies, view_frequencies: octaves.
    """

    coordinate: Tensor

    def __init__(
        self,
        num_layers: int,
        num_frames: int,
        hidden_layers: int,
        width: int,
        latent_dim: int,
        uv_frequencies: int,
        level_frequencies: int,
        view_frequencies: int,
    ) -> None:
        super().__init__()
        self.uv_frequencies, self.view_frequencies = uv_frequencies, view_frequencies
        coordinate = torch.linspace(1, -1, num_layers) if num_layers > 1 else torch.zeros(1)
        encoded = positional_encoding(coordinate[:, None], level_frequencies)
        self.register_buffer("coordinate", encoded, persistent=False)
        self.latents = nn.Parameter(0.1 * torch.randn(num_frames, latent_dim))
        inputs = encoded_size(2, uv_frequencies) + encoded_size(1, level_frequencies) + latent_dim
        self.hidden = LinearStack([inputs] + [width] * hidden_layers)
        self.base = nn.Linear(width, 4)
        self.view = nn.Linear(width + encoded_size(3, view_frequencies), 1)
        with torch.no_grad():
            for layer in self.hidden:
                nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
                nn.init.zeros_(layer.bias)
            nn.init.normal_(self.base.weight, std=0.5 / width**0.5)
            self.base.bias.copy_(torch.tensor([0.0, 0.0, 0.0, -1.5]))  # opacity: all layers are seen. Ours
            nn.init.zeros_(self.view.weight)
            nn.init.zeros_(self.view.bias)

    def reflection_maps(self) -> ReflectionMaps | None:
        """None: the view branch is dropped at export."""
        return None

    def texel_grid(self) -> TexelGrid | None:
        """None: it is looked up anywhere alike."""
        return None

    @property
    def num_frames(self) -> int:
        return len(self.latents)

    def latent(self, time: Tensor) -> Tensor:
        """Latents [P, D] at frame times [P]: linear between frames, held beyond the first and the last."""
        time = time.clamp(0, self.num_frames - 1)
        before = time.floor().long()
        after = (before + 1).clamp(max=self.num_frames - 1)
        # embedding() and not indexing: its gradient adds up in a fixed order, so that training repeats bit for bit.
        return torch.lerp(embedding(before, self.latents), embedding(after, self.latents), (time - before)[:, None])

    def sheet(self, uv: Tensor, layer: int, time: float) -> Shaded:
        """Points at uv [P, 2] of one layer at one time: `shade` without a view term, in bounded memory."""
        parts = []
        for at in uv.split(TEXELS_AT_ONCE):
            layers = torch.full((len(at),), layer, dtype=torch.int64, device=uv.device)
            parts.append(
                self.shade(at, layers, torch.full((len(at),), float(time), dtype=uv.dtype, device=uv.device), None)
            )
        return Shaded(torch.cat([part.rgb for part in parts]), torch.cat([part.alpha for part in parts]), None)

    def shade(self, uv: Tensor, layer: Tensor, time: Tensor, directions: Tensor | None) -> Shaded:
        """Points at uv [P, 2] of layers [P] (int64), at frame times [P]; directions [P, 3] of the rays, or None."""
        encoded = positional_encoding(uv, self.uv_frequencies)
        h = torch.cat([encoded, self.coordinate[layer], self.latent(time)], -1)
        for linear in self.hidden:
            h = relu(linear(h))
        base = torch.sigmoid(self.base(h))
        view = None
        if directions is not None:
            view = self.view(torch.cat([h, positional_encoding(directions, self.view_frequencies)], -1)).squeeze(-1)
        return Shaded(base[:, :3], base[:, 3], view)
