"""A trained model seen from one camera, with and without its view branch, in any number of frames."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.geometry.cameras import Camera
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.compositing import compositing_weights

Image = NDArray[np.float32]

CROSSINGS_AT_ONCE = 65_536
"""Crossings that are shaded together: bounds the memory."""


class ModelView:
    """The surfaces stand still, so the crossings of a camera's rays are found once and serve all frames.

    `render` shows what `RadianceManifolds.render` shows, both of its variants from one evaluation of the textures.

    Args:
        model: in evaluation mode.
        camera: rays through its pixel centres.
    """

    def __init__(self, model: RadianceManifolds, camera: Camera) -> None:
        device = model.centre.device
        rays = [torch.tensor(np.reshape(part, (-1, 3)), dtype=torch.float32, device=device) for part in camera.rays()]
        crossings = model.crossings(*rays)
        self._model = model
        self._size = (camera.height, camera.width)
        self._hit = crossings.hit
        self._ray, self._layer = crossings.hit.nonzero(as_tuple=True)
        self._uv = model.chart.uv(crossings.points[self._ray, self._layer])[0]
        self._directions = rays[1]

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
            shaded = self._model.textures.shade(uv, layer, times, self._directions[ray])
            view = torch.zeros_like(shaded.alpha[:, None]) if shaded.added is None else shaded.added
            parts.append((shaded.rgb, view, shaded.alpha))
        return parts

    def _sum(self, colours: Tensor) -> Image:
        """Add up the crossings' colours [P, 3] of each pixel."""
        image = torch.zeros((len(self._hit), 3), device=colours.device).index_add_(0, self._ray, colours)
        result: Image = image.clamp(0, 1).reshape(*self._size, 3).cpu().numpy()
        return result
