"""What one camera sees of a trained model, with and without its view branch, and of its asset, in any frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import uv_to_st
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.compositing import compositing_weights
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.intersection import Crossings
from facefolds_core.rendering.areas import AreaView, view_of
from facefolds_core.rendering.pixels import finer, pixel_means
from facefolds_core.rendering.reference import Hits

Image = NDArray[np.float32]
Pictures = tuple[Image, Image, Image]
"""rgb with the view branch (H, W, 3), rgb without it (H, W, 3), alpha (H, W), in [0, 1] and over black."""

CROSSINGS_AT_ONCE = 65_536
"""Crossings that are shaded together: bounds the memory."""


class ModelView:
    """The surfaces stand still, so the crossings of a camera's rays are found once and serve all frames. Each pixel is
    the mean of its area (`rendering.pixels`).

    `render` shows what `RadianceManifolds.render` shows, both of its variants from one evaluation of the textures.

    Args:
        model: in evaluation mode.
        camera: in the model's axes.
        pose: of the head in the frame that is shown, from these axes to the room's, which reflected light and a torso
            are fixed to; None of one that stands still.
    """

    def __init__(self, model: RadianceManifolds, camera: Camera, pose: Similarity | None = None) -> None:
        grids = isinstance(model.textures, GridTextures)
        self._seen: _GridView | _Networks = (_GridView if grids else _Networks)(model, camera, pose)

    @torch.no_grad()
    def render(self, time: float) -> Pictures:
        """One frame; `time`: its index, possibly between frames."""
        return self._seen.render(time)


class _GridView:
    """Texel grids: looked up as the asset's textures are."""

    def __init__(self, model: RadianceManifolds, camera: Camera, pose: Similarity | None) -> None:
        assert isinstance(model.textures, GridTextures)
        self._model, self._textures, self._pose = model, model.textures, pose
        to_room, device = None if pose is None else pose.rotation, model.centre.device
        self._to_room = None if to_room is None else torch.tensor(to_room, dtype=torch.float32, device=device)
        self._view = AreaView.of_hits(camera, self._hits)

    @torch.no_grad()
    def _hits(self, camera: Camera) -> tuple[Hits, Sequence[Image] | None]:
        """Of part of the picture, and what the reflection adds there."""
        rays, crossings = _cross(self._model, camera, self._pose)
        st = uv_to_st(self._model.chart.uv(crossings.points)[0], self._textures.window).float()
        shape = (camera.height, camera.width, self._model.num_layers)
        hits = Hits(crossings.hit.cpu().numpy().reshape(shape), st.cpu().numpy().reshape(*shape, 2))
        reflection = self._textures.reflection
        if reflection is None:
            return hits, None
        added = []
        for n in range(self._model.num_layers):
            hit = crossings.hit[:, n]
            added.append(reflection.added(st[hit, n], rays[1][hit], self._to_room).cpu().numpy())
        return hits, added

    def render(self, time: float) -> Pictures:
        images = [self._textures.image(n, time).cpu().numpy() for n in range(self._model.num_layers)]
        with_view, alpha = self._view.composite(images)
        without = with_view if self._textures.reflection is None else self._view.composite(images, lit=False)[0]
        return with_view, without, alpha


class _Networks:
    """Textures that are evaluated at each crossing."""

    def __init__(self, model: RadianceManifolds, camera: Camera, pose: Similarity | None) -> None:
        fine = finer(camera)
        rays, crossings = _cross(model, fine, pose)
        self._model, self._size, self._hit = model, (fine.height, fine.width), crossings.hit
        self._ray, self._layer = crossings.hit.nonzero(as_tuple=True)
        self._uv = model.chart.uv(crossings.points[self._ray, self._layer])[0]
        self._directions = rays[1]

    def render(self, time: float) -> Pictures:
        rgb, view, opacity = (torch.cat(parts) for parts in zip(*self._shaded(time), strict=True))
        alpha = torch.zeros(self._hit.shape, device=rgb.device)
        alpha[self._ray, self._layer] = opacity
        weights, transmittance = compositing_weights(alpha)
        weight = weights[self._ray, self._layer][:, None]
        with_view = self._sum(weight * (rgb + view))
        through = transmittance.reshape(self._size).cpu().numpy()
        return with_view, self._sum(weight * rgb), 1 - pixel_means(through)

    def _shaded(self, time: float) -> list[tuple[Tensor, Tensor, Tensor]]:
        """Colour [P, 3], view term [P, 1] and opacity [P] of all crossings, in parts."""
        parts = []
        pieces = zip(*(t.split(CROSSINGS_AT_ONCE) for t in (self._uv, self._layer, self._ray)), strict=True)
        for uv, layer, ray in pieces:
            times = torch.full((len(uv),), float(time), dtype=uv.dtype, device=uv.device)
            shaded = self._model.textures.shade(uv, layer, times, self._directions[ray])
            view = torch.zeros_like(shaded.alpha[:, None]) if shaded.added is None else shaded.added
            parts.append((shaded.rgb, view, shaded.alpha))
        return parts

    def _sum(self, colours: Tensor) -> Image:
        """Add up the crossings' colours [P, 3] of each ray."""
        image = torch.zeros((len(self._hit), 3), device=colours.device).index_add_(0, self._ray, colours)
        return pixel_means(image.clamp(0, 1).reshape(*self._size, 3).cpu().numpy())


def _cross(model: RadianceManifolds, camera: Camera, pose: Similarity | None) -> tuple[list[Tensor], Crossings]:
    """Origins and directions [R, 3] through all pixel centres, and their crossings."""
    device = model.centre.device
    rays = [torch.tensor(np.reshape(part, (-1, 3)), dtype=torch.float32, device=device) for part in camera.rays()]
    return rays, model.crossings(rays[0], rays[1], pose)


class PosedView:
    """One camera: looked through once for a head that stands still, else in each frame anew.

    The model stands where the scene's poses say; the asset where its own track does: what ships is scored.

    Args:
        camera: in the world.

    Attributes:
        asset: the asset's view, its reflection with it.
        model: the model's view.
    """

    def __init__(self, scene: Scene, model: RadianceManifolds, asset: Asset, camera: Camera) -> None:
        self._poses, self._model, self._files = scene.poses, model, asset
        self._camera = camera
        self._turn_model(0)
        self._turn_asset(0)

    def turn(self, frame: int) -> None:
        """To a frame of the scene."""
        if self._poses is not None:
            self._turn_model(frame)
        if self._files.track is not None:
            self._turn_asset(frame)

    def _turn_model(self, frame: int) -> None:
        camera = self._camera if self._poses is None else self._poses.camera(self._camera, frame)
        self.model = ModelView(self._model, camera, None if self._poses is None else self._poses.at(frame))

    def _turn_asset(self, frame: int) -> None:
        self.asset = view_of(self._files.full, self._camera, frame)
