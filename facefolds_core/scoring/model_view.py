"""A trained model seen from one camera, with and without its view branch, in any number of frames."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.sphere_uv import uv_to_st
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.compositing import compositing_weights
from facefolds_core.model.grids import GridTextures

Image = NDArray[np.float32]

CROSSINGS_AT_ONCE = 65_536
"""Crossings that are shaded together: bounds the memory."""


class ModelView:
    """The surfaces stand still, so the crossings of a camera's rays are found once and serve all frames.

    `render` shows what `RadianceManifolds.render` shows, both of its variants from one evaluation of the textures.

    Args:
        model: in evaluation mode.
        camera: rays through its pixel centres, in the model's axes.
        to_room: (3, 3) rotation from these to the axes of the room, which reflected light is fixed to; None for none.
    """

    def __init__(self, model: RadianceManifolds, camera: Camera, to_room: NDArray[np.float64] | None = None) -> None:
        device = model.centre.device
        rays = [torch.tensor(np.reshape(part, (-1, 3)), dtype=torch.float32, device=device) for part in camera.rays()]
        crossings = model.crossings(*rays)
        self._model = model
        self._size = (camera.height, camera.width)
        self._hit = crossings.hit
        self._ray, self._layer = crossings.hit.nonzero(as_tuple=True)
        self._uv = model.chart.uv(crossings.points[self._ray, self._layer])[0]
        self._directions = rays[1]
        self._to_room = None if to_room is None else torch.tensor(to_room, dtype=torch.float32, device=device)

    @torch.no_grad()
    def render(self, time: float) -> tuple[Image, Image, Image]:
        """One frame, over black.

        Args:
            time: frame index, possibly between frames.

        Returns:
            rgb with the view branch (H, W, 3), rgb without it (H, W, 3), alpha (H, W), in [0, 1].
        """
        rgb, view, opacity = (torch.cat(parts) for parts in zip(*self._shaded(time), strict=True))
        alpha = torch.zeros(self._hit.shape, device=rgb.device)
        alpha[self._ray, self._layer] = opacity
        weights, transmittance = compositing_weights(alpha)
        weight = weights[self._ray, self._layer][:, None]
        with_view = self._sum(weight * (rgb + view))
        return with_view, self._sum(weight * rgb), (1 - transmittance).reshape(self._size).cpu().numpy()

    def _shaded(self, time: float) -> list[tuple[Tensor, Tensor, Tensor]]:
        """Colour [P, 3], view term [P, 1] or [P, 3] and opacity [P] of all crossings, in parts."""
        parts = []
        pieces = zip(*(t.split(CROSSINGS_AT_ONCE) for t in (self._uv, self._layer, self._ray)), strict=True)
        for uv, layer, ray in pieces:
            times = torch.full((len(uv),), float(time), dtype=uv.dtype, device=uv.device)
            textures, directions = self._model.textures, self._directions[ray]
            turned = self._to_room is not None and isinstance(textures, GridTextures)
            shaded = textures.shade(uv, layer, times, None if turned else directions)
            added = self._turned(uv, directions) if turned else shaded.added
            view = torch.zeros_like(shaded.alpha[:, None]) if added is None else added
            parts.append((shaded.rgb, view, shaded.alpha))
        return parts

    def _turned(self, uv: Tensor, directions: Tensor) -> Tensor | None:
        """[P, 3] of the reflection, its light turned with the room."""
        textures = self._model.textures
        assert isinstance(textures, GridTextures)
        if textures.reflection is None:
            return None
        return textures.reflection.added(uv_to_st(uv, textures.window), directions, self._to_room)

    def _sum(self, colours: Tensor) -> Image:
        """Add up the crossings' colours [P, 3] of each pixel."""
        image = torch.zeros((len(self._hit), 3), device=colours.device).index_add_(0, self._ray, colours)
        result: Image = image.clamp(0, 1).reshape(*self._size, 3).cpu().numpy()
        return result
