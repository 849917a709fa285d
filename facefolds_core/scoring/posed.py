"""What a camera sees of a model and of its asset, whether the head stands still or turns."""

from __future__ import annotations

from contextlib import nullcontext

import torch

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.model import RadianceManifolds
from facefolds_core.rendering.areas import view_of
from facefolds_core.scoring.model_view import ModelView


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
        # Without gradients layers are crossed by compiled code: in each frame anew torch's own would take minutes.
        with nullcontext() if self._poses is None else torch.no_grad():
            to_room = None if self._poses is None else self._poses.at(frame).rotation
            self.model = ModelView(self._model, camera, to_room)

    def _turn_asset(self, frame: int) -> None:
        self.asset = view_of(self._files.full, self._camera, frame)
