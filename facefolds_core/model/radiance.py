"""Radiance manifolds: surfaces and textures put together. Everything after training asks only this class."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.geometry.torso import Torso
from facefolds_core.model.compositing import compositing_weights
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.intersection import Crossings
from facefolds_core.model.manifolds import MlpManifolds
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.textures import MlpTextures, TexelGrid

RAYS_AT_ONCE = 8192
"""Rays that `render` and `surface_points` work on together: bounds their memory."""


@dataclass(frozen=True)
class Rendered:
    """R composited rays.

    Attributes:
        rgb: [R, 3] in [0, 1], over black.
        alpha: [R] opacity.
        weights: [R, N] of the layers, outermost first.
    """

    rgb: Tensor
    alpha: Tensor
    weights: Tensor


@dataclass(frozen=True)
class Traced:
    """R rays in the training loop: unclamped, with gradients.

    Attributes:
        rgb: [R, 3] over black, not clamped.
        weights: [R, N].
        view: [P] or [P, 3] the view-dependent term at the P crossings of all rays; None if it was switched off.
    """

    rgb: Tensor
    weights: Tensor
    view: Tensor | None


class RadianceManifolds(nn.Module):
    """N nested surfaces with RGBA textures in time.

    Args:
        manifolds: where the layers are.
        textures: what they look like.
    """

    def __init__(self, manifolds: MlpManifolds | RadialManifolds, textures: MlpTextures | GridTextures) -> None:
        super().__init__()
        self.manifolds = manifolds
        self.textures = textures

    @property
    def num_layers(self) -> int:
        return self.manifolds.num_layers

    @property
    def num_frames(self) -> int:
        return self.textures.num_frames

    @property
    def centre(self) -> Tensor:
        """[3], c."""
        return self.manifolds.centre

    @property
    def chart(self) -> Chart:
        """Where (u, v) and radii lie."""
        return self.manifolds.chart

    @property
    def torso(self) -> Torso | None:
        """What stays in the room while the head turns."""
        return self.manifolds.torso

    @property
    def window(self) -> Window:
        """(u0, u1, v0, v1) beyond which there are no surfaces."""
        return self.manifolds.window

    def reflection_maps(self) -> ReflectionMaps | None:
        """The reflection that all layers and frames share, where the textures have one."""
        return self.textures.reflection_maps()

    def texel_grid(self) -> TexelGrid | None:
        """The texels between which the textures are bilinear, where they have some."""
        return self.textures.texel_grid()

    def trace(self, origins: Tensor, directions: Tensor, time: Tensor, view_effects: bool) -> Traced:
        """Cross, shade and composite rays, all at once and differentiable.

        Args:
            origins, directions: [R, 3], directions of unit length.
            time: [R] frame indices, possibly between frames.
            view_effects: add the view-dependent term.
        """
        crossings = self.manifolds.crossings(origins, directions)
        ray, layer = crossings.hit.nonzero(as_tuple=True)
        uv, _ = self.chart.uv(crossings.points[ray, layer])
        shaded = self.textures.shade(uv, layer, time[ray], directions[ray] if view_effects else None)
        colour = shaded.rgb if shaded.added is None else shaded.rgb + shaded.added
        alpha = torch.zeros_like(crossings.distance).index_put((ray, layer), shaded.alpha)
        weights, _ = compositing_weights(alpha)
        # Dense [R, N, 3]: index_add along rays would be one small operation a crossing on a CPU.
        colours = torch.zeros_like(crossings.points).index_put((ray, layer), colour)
        return Traced((weights[..., None] * colours).sum(1), weights, shaded.view)

    @torch.no_grad()
    def crossings(self, origins: Tensor, directions: Tensor, pose: Similarity | None = None) -> Crossings:
        """Nearest crossing of each ray with each layer, outermost first.

        Args:
            origins, directions: [R, 3], directions of unit length.
            pose: of the head, which turns over a torso; points are those of the layers as they were made.
        """
        parts = [self.manifolds.crossings(o, d, pose) for o, d in _chunks(origins, directions)]
        return Crossings(
            torch.cat([p.points for p in parts]),
            torch.cat([p.distance for p in parts]),
            torch.cat([p.hit for p in parts]),
        )

    @torch.no_grad()
    def render(self, origins: Tensor, directions: Tensor, time: float | Tensor, view_effects: bool) -> Rendered:
        """Colour of rays over black, clamped to [0, 1].

        Args:
            origins, directions: [R, 3], directions of unit length.
            time: frame index, possibly between frames: one number or [R].
            view_effects: with the view-dependent term; False shows what an asset can show.
        """
        times = torch.as_tensor(time, dtype=origins.dtype, device=origins.device).expand(len(origins))
        parts = [self.trace(o, d, t, view_effects) for o, d, t in _chunks(origins, directions, times)]
        weights = torch.cat([p.weights for p in parts])
        return Rendered(torch.cat([p.rgb for p in parts]).clamp(0, 1), weights.sum(-1), weights)

    @torch.no_grad()
    def surface_points(self, uv: Tensor) -> tuple[Tensor, Tensor]:
        """Each layer along the directions (u, v).

        Args:
            uv: [M, 2] in [-1, 1].

        Returns:
            points [N, M, 3] and valid [N, M] bool (False where the layer has no point in that direction).
        """
        parts = [self.manifolds.radii_at(at) for at in uv.split(RAYS_AT_ONCE)]
        radii, valid = (torch.cat(tensors) for tensors in zip(*parts, strict=True))
        return self.chart.points(uv, radii.T), valid.T

    @torch.no_grad()
    def texture(self, uv: Tensor, layer: int, time: float) -> tuple[Tensor, Tensor]:
        """Colour and opacity of one layer, without the view branch.

        Args:
            uv: [M, 2] in [-1, 1].
            layer: index, outermost first.
            time: frame index, possibly between frames.

        Returns:
            rgb [M, 3] and alpha [M], in [0, 1].
        """
        shown = self.textures.sheet(uv, layer, time)
        return shown.rgb, shown.alpha


def _chunks(*tensors: Tensor) -> list[tuple[Tensor, ...]]:
    return list(zip(*(t.split(RAYS_AT_ONCE) for t in tensors), strict=True))
