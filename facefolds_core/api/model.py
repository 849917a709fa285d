"""A trained model: it renders, and becomes an asset."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsIndex

from facefolds_core.api.asset import Asset, load_asset
from facefolds_core.api.cameras import camera_named
from facefolds_core.api.pictures import Colour, Picture, check_frame, picture
from facefolds_core.api.scene import Scene, load_scene
from facefolds_core.api.subject import Subject, find_subject
from facefolds_core.api.work import folders_of, run, set_params
from facefolds_core.captures.found_scene import GAUSSIANS
from facefolds_core.config.stages import read_train
from facefolds_core.errors import UserError
from facefolds_core.files.writing import atomic_folder
from facefolds_core.geometry.cameras import Camera
from facefolds_core.model import RadianceManifolds
from facefolds_core.model import load_model as read_model
from facefolds_core.model.device import device_of
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.report import EXPORT_STAGES


@dataclass(frozen=True, repr=False)
class Model:
    """Nested surfaces with textures in time.

    Attributes:
        scene: that it was trained on.
        manifolds: the model itself, a torch module in evaluation mode.
    """

    scene: Scene
    manifolds: RadianceManifolds

    def __repr__(self) -> str:
        return f"Model({self.scene.subject}: {self.manifolds.num_layers} layers, {self.manifolds.num_frames} frames)"

    def render(self, camera: Camera | str, frame: SupportsIndex, background: Colour | None = None) -> Picture:
        """One picture, each pixel the mean of its area.

        Args:
            camera: in the scene's world, or the name of one of the scene's.
            frame: 0 to the scene's number of frames - 1.
            background: RGB, 0 to 1; None leaves it transparent.

        Returns:
            (H, W, 4) uint8, RGBA with straight alpha; with a background (H, W, 3) uint8, RGB.

        Raises:
            UserError: if there is no such camera or frame.
        """
        number = check_frame(frame, self.scene.num_frames, "the scene")
        if isinstance(camera, str):
            camera = camera_named(camera, self.scene.cameras, "camera")
        poses = self.scene.poses
        turn = None if poses is None else poses.at(number)
        seen = camera if poses is None else poses.camera(camera, number)
        rgb, _, alpha = ModelView(self.manifolds, seen, turn).render(number)
        return picture(rgb, alpha, background)

    def export(self, folder: str | Path | None = None, **sections: Mapping[str, Any]) -> Asset:
        """Make the asset: sample, reconstruct, decimate, texture, bake, compress.

        Args:
            folder: of the asset, written whole or not at all; None leaves it in the folder of work.
            sections: parameters of these six steps, such as `texture={"resolution": 256}` (docs/reference/params.md).

        Returns:
            the asset, as read from its files.

        Raises:
            UserError: if a section, key or value is wrong, or the result cannot be an asset.
        """
        unknown = sorted(set(sections) - set(EXPORT_STAGES))
        if unknown:
            known = ", ".join(EXPORT_STAGES)
            raise UserError("no step of the export", place=", ".join(unknown), expected=known, remedy="correct it")
        folders = folders_of(self.scene)
        for stage in EXPORT_STAGES:
            set_params(folders, stage, sections.get(stage, {}))
        for stage in EXPORT_STAGES:
            run(stage, folders, folders.asset)
        if folder is not None:
            with atomic_folder(folder) as temporary:
                shutil.copytree(folders.asset, temporary, dirs_exist_ok=True)
        return load_asset(folders.asset if folder is None else folder, folders.root)


def train(scene: Scene, subject: Subject | None = None, **params: Any) -> Model:
    """Fit the model to the scene's training cameras; what is not well is in the scene's `left_out` and the scores.

    Args:
        scene: of `normalize` or `load_scene`.
        subject: of `find_subject`; None takes what was found before, else looks for it first.
        params: keys of the section `train`, such as `preset="quick"` (docs/reference/params.md).

    Raises:
        UserError: if subject and scene do not belong together, training diverges, or a key or value is wrong.
    """
    folders = folders_of(scene)
    set_params(folders, "train", params)
    if subject is None and not (folders.subject / GAUSSIANS).exists():
        subject = find_subject(scene)
    if subject is not None and subject.folder != folders.subject:
        raise UserError(
            "the subject and the scene do not belong together",
            file=subject.folder,
            expected=f"the subject of {scene.folder}",
            remedy="pass what find_subject(scene) gives for this scene",
        )
    run("train", folders, folders.model)
    return _model_of(scene)


def load_model(path: str | Path, folder: str | Path | None = None) -> Model:
    """Read a model that was trained before.

    Args:
        path: `data/NAME/model`; the scene lies beside it.
        folder: of the work from here on, see `load_scene`.

    Raises:
        UserError: if there is no model or scene, or one is damaged.
    """
    path = Path(path)
    if path.name != "model" or not path.is_dir():
        expected = "data/NAME/model, beside data/NAME/scene"
        raise UserError("no model there", file=path, expected=expected, remedy="train one: facefolds_core.train(scene)")
    return _model_of(load_scene(path.parent / "scene", folder))


def _model_of(scene: Scene) -> Model:
    folders = folders_of(scene)
    return Model(scene, read_model(folders.model, device_of(read_train(folders.config))))
