"""Score the shipped asset, and the model it came from, on the held-out cameras (docs/reference/metrics.md).

An asset at a multiple of the capture's frame rate is scored on the frames that have photos.

One camera at a time, one frame at a time: memory is bounded by one camera's crossings, whatever the number of images.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.model import RadianceManifolds
from facefolds_core.packaging.views import spread
from facefolds_core.params import EvaluateParams
from facefolds_core.progress import progress
from facefolds_core.rendering import AssetCaster, composite
from facefolds_core.rendering.effects import added_colours, to_eye
from facefolds_core.scoring.analysis import Sums
from facefolds_core.scoring.metrics import Array, psnr, shown, ssim
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.panels import METRICS, SUBJECT_METRICS, WITH_EFFECTS, ImageScore, Panel
from facefolds_core.scoring.perceptual import Perceptual, PerceptualDistance
from facefolds_core.scoring.record import Seen

MASK_EDGE = 0.1
"""The subject is where its opacity exceeds this: for the box of the perceptual metrics, and to tell an empty mask."""
MASK_MARGIN = 8
"""Pixels added to that box on each side, within the frame."""


@dataclass(frozen=True)
class Evaluation:
    """What was found.

    Attributes:
        scores: all of them.
        panels: of the contact sheet.
        worst: the picture on which the asset's PSNR is lowest (of the subject, where that is known).
        seen: what the asset's layers do in the pictures of the contact sheet.
    """

    scores: list[ImageScore]
    panels: list[Panel]
    worst: Panel
    seen: Seen


def evaluate(
    scene: Scene, model: RadianceManifolds, asset: Asset, params: EvaluateParams, perceptual: Perceptual
) -> Evaluation:
    """Render and score every frame of every held-out camera; shows a progress bar.

    Raises:
        UserError: if there is no held-out camera, the three do not belong together, or a picture has NaN in it.
    """
    held_out = scene.indices("holdout")
    _check(scene, model, held_out)
    step = frame_rate_factor(scene, asset)
    truths, masks = scene.open_frames(), scene.open_masks()
    on_sheet = spread(scene.num_frames, params.sheet_frames)
    caster = AssetCaster(asset)
    scores: list[ImageScore] = []
    panels: list[Panel] = []
    worst: Panel | None = None
    sums = Sums(asset.layers)
    count = sum(camera in held_out for camera, _ in truths)
    with progress(total=count, desc="evaluate", unit="image") as bar:
        for index in held_out:
            camera = scene.cameras[index]
            frames = [k for k in range(scene.num_frames) if (index, k) in truths]
            views = _Views(scene, model, asset, caster, index, step)
            for k, textures, images in _rendered(views, asset, frames, params.background, step):
                frame = scene.frame_ids[k]
                _check_finite(images, camera.name, frame)
                pictures = {variant: shown(image) for variant, image in images.items()}
                truth = truths.image(index, k) / 255.0
                has_mask = masks is not None and (index, k) in masks
                mask = masks.image(index, k)[..., 0] / 255.0 if masks is not None and has_mask else None
                found = score_images(pictures, truth, mask, perceptual)
                group = {v: ImageScore(camera.name, frame, v, values) for v, values in found.items()}
                scores += group.values()
                shot = (truth, pictures["model"], pictures["asset"])
                panel = Panel(camera.name, frame, *shot, group["model"], group["asset"], mask)
                worst = panel if worst is None else min(worst, panel, key=lambda one: one.rank)
                if k in on_sheet:
                    panels.append(panel)
                    sums.add_picture(views.seen_by, views.hits, textures, pictures["asset"] - truth, mask)
                bar.update()
    if worst is None:
        raise UserError(
            "no held-out camera has a photo: there is nothing to score on",
            file=scene.folder / "frames.arrow",
            remedy="hold out cameras with photos, under subjects.<name>.holdout in params.yaml",
        )
    return Evaluation(scores, panels, worst, sums.result())


def score_images(
    images: dict[str, Array], truth: Array, mask: Array | None, perceptual: Perceptual
) -> dict[str, dict[str, float | None]]:
    """All metrics of several renderings of one view.

    Args:
        images: name -> (H, W, 3) in [0, 1].
        truth: (H, W, 3).
        mask: (H, W) opacity of the subject, or None.
    """
    pictures = list(images.values())
    frame = {"lpips": _distances(perceptual.lpips, pictures, truth)}
    frame["st_lpips"] = _distances(perceptual.st_lpips, pictures, truth)
    box = None if mask is None else subject_box(mask)
    if mask is not None and box is not None:
        cut = [(image * mask[..., None])[box] for image in [truth, *pictures]]
        frame["lpips_subject"] = _distances(perceptual.lpips, cut[1:], cut[0])
        frame["st_lpips_subject"] = _distances(perceptual.st_lpips, cut[1:], cut[0])
    result: dict[str, dict[str, float | None]] = {}
    for i, (name, image) in enumerate(images.items()):
        values: dict[str, float | None] = dict.fromkeys((*METRICS, *SUBJECT_METRICS))
        values |= {key: per_image[i] for key, per_image in frame.items()}
        values |= {"psnr": psnr(image, truth), "ssim": ssim(image, truth)}
        if box is not None:
            values |= {"psnr_subject": psnr(image, truth, mask), "ssim_subject": ssim(image, truth, mask)}
        result[name] = values
    return result


def subject_box(mask: Array) -> tuple[slice, slice] | None:
    """Rows and columns of the subject with a margin; None where the mask is empty."""
    rows, columns = np.nonzero(mask > MASK_EDGE)
    if not len(rows):
        return None
    return (
        slice(max(0, rows.min() - MASK_MARGIN), rows.max() + 1 + MASK_MARGIN),
        slice(max(0, columns.min() - MASK_MARGIN), columns.max() + 1 + MASK_MARGIN),
    )


class _Views:
    """What one held-out camera sees of model and asset: found once for a head that stands still, else frame by frame.

    The model stands where the scene's poses say; the asset where its own track does: what ships is scored.

    Attributes:
        seen_by: the camera in the frame of the asset's meshes.
        hits: there.
        model: the model's view.
        added: what view effects add, or None.
    """

    def __init__(
        self, scene: Scene, model: RadianceManifolds, asset: Asset, caster: AssetCaster, index: int, step: int
    ) -> None:
        self._scene, self._model, self._asset, self._caster = scene, model, asset, caster
        self._index, self._step = index, step
        self._maps = asset.effects()
        self._turn_model(0)
        self._turn_asset(0)

    def _turn_model(self, k: int) -> None:
        self.model = ModelView(self._model, self._scene.camera_in_head(self._index, k))

    def _turn_asset(self, k: int) -> None:
        self.seen_by = self._asset.camera_in_head(self._scene.cameras[self._index], k * self._step)
        self.hits = self._caster.cast(self.seen_by)
        self.added = None if self._maps is None else added_colours(self.hits, to_eye(self.seen_by), self._maps)

    def turn(self, k: int) -> None:
        """To frame `k` of the scene."""
        if self._scene.poses is not None:
            self._turn_model(k)
        if self._asset.track is not None:
            self._turn_asset(k)


def _rendered(
    views: _Views, asset: Asset, frames: list[int], background: tuple[float, float, float], step: int
) -> Iterator[tuple[int, Sequence[NDArray[np.uint8]], dict[str, NDArray[np.float32]]]]:
    """The asset's textures, and the variants' images (H, W, 3) over `background`, of each of the scene's `frames`."""
    for k, textures in shipped(asset, frames, step):
        views.turn(k)
        with_view, without_view, alpha = views.model.render(float(k))
        behind = (1 - alpha)[..., None] * np.asarray(background, np.float32)
        picture, _ = composite(views.hits, textures, background)
        images = {"model": with_view + behind, "diffuse": without_view + behind, "asset": picture}
        if views.added is not None:
            images[WITH_EFFECTS], _ = composite(views.hits, textures, background, views.added)
        yield k, textures, images


def shipped(asset: Asset, frames: list[int], step: int) -> Iterator[tuple[int, Sequence[NDArray[np.uint8]]]]:
    """The textures of the scene's `frames`; decoded in one go if that is all that have photos."""
    if len(frames) * step == asset.num_frames:
        return ((k // step, textures) for k, textures in enumerate(asset.frames()) if k % step == 0)
    return ((k, asset.frame(k * step)) for k in frames)


def frame_rate_factor(scene: Scene, asset: Asset) -> int:
    """Frames of the asset a frame of the scene, whose frame k is the asset's k times this.

    Raises:
        UserError: if it is not a whole number.
    """
    factor, rest = divmod(asset.num_frames, scene.num_frames)
    if rest or not factor:
        raise _wrong_frames("asset", f"{scene.num_frames} frames, as in the scene, or a multiple", asset, scene)
    return factor


def _wrong_frames(what: str, expected: str, found: Asset | RadianceManifolds, scene: Scene) -> UserError:
    return UserError(
        f"the {what} and the scene have different numbers of frames",
        file=scene.folder / "scene.json",
        expected=expected,
        found=f"{found.num_frames} in the {what}",
        remedy="run `dvc repro`, which makes both from the same scene",
    )


def _distances(metric: PerceptualDistance | None, images: list[Array], truth: Array) -> list[float | None]:
    if metric is None:
        return [None] * len(images)
    device = metric.shift.device
    stack = torch.tensor(np.stack([truth, *images]), dtype=torch.float32, device=device).permute(0, 3, 1, 2)
    return [float(d) for d in metric(stack[1:], stack[0])]


def _check(scene: Scene, model: RadianceManifolds, held_out: list[int]) -> None:
    if not held_out:
        raise UserError(
            "no held-out camera: there is nothing to score on",
            file=scene.folder / "scene.json",
            expected="at least one camera with split holdout",
            found=f"{len(scene.cameras)} cameras, all for training",
            remedy="name held-out cameras under subjects.<name>.holdout in params.yaml, or set {every: n} there",
        )
    if model.num_frames != scene.num_frames:
        raise _wrong_frames("model", f"{scene.num_frames} frames, as in the scene", model, scene)


def _check_finite(images: dict[str, NDArray[np.float32]], camera: str, frame: str) -> None:
    for variant, image in images.items():
        if not np.isfinite(image).all():
            raise UserError(
                f"the rendering of the {variant} has numbers that are not finite",
                place=f"camera {camera}, frame {frame}",
                expected="colours in [0, 1]",
                found=f"{int((~np.isfinite(image)).any(-1).sum())} pixels with NaN or infinity",
                remedy="the model is damaged: train again with a smaller learning rate or another seed",
            )
