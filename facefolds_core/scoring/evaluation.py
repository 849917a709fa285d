"""Score the shipped asset, and the model it came from, on cameras that did not train (docs/reference/metrics.md).
One camera at a time, a few frames at a time: memory is bounded by one camera's crossings, whatever the take's length.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene, Split, check_frames
from facefolds_core.errors import UserError
from facefolds_core.model import RadianceManifolds
from facefolds_core.params import EvaluateParams
from facefolds_core.progress import progress
from facefolds_core.scoring.backgrounds import Rendering, WorstPatch, find_patch
from facefolds_core.scoring.films import FilmFolder, FilmRoll
from facefolds_core.scoring.images import cutout_of, region_of, score_renderings
from facefolds_core.scoring.metrics import shown
from facefolds_core.scoring.model_view import PosedView
from facefolds_core.scoring.panels import Evaluation, ImageScore, Panel
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.scoring.temporal import Film, Sums, change_of
from facefolds_core.scoring.training_views import training_views
from facefolds_core.scoring.truths import Truth, Truths
from facefolds_core.spacing import spread
from facefolds_core.system.threads import in_order

SCORED: tuple[Split, ...] = ("holdout", "validate")


def evaluate(
    scene: Scene,
    model: RadianceManifolds,
    asset: Asset,
    params: EvaluateParams,
    perceptual: Perceptual,
    films: Path | None = None,
) -> Evaluation:
    """Render and score every frame of every camera that did not train; shows a progress bar.

    Args:
        films: folder in which films of the held-out cameras are put; None makes none.

    Raises:
        UserError: if there is no held-out camera, the three do not belong together, or a picture has NaN in it.
    """
    _check(scene, model, asset)
    scorer = _Scorer(scene, asset, params, perceptual)
    rolls = FilmFolder(films if params.films else None, scene.fps)
    changes = {}
    with progress(total=len(scorer.keys), desc="evaluate", unit="image") as bar:
        for split in SCORED:
            sums = []
            for index in scene.indices(split):
                view = PosedView(scene, model, asset, scene.cameras[index])
                filming = rolls.roll(scene.cameras[index].name) if split == "holdout" else nullcontext()
                with filming as roll:
                    sums.append(scorer.score(split, index, view, roll, bar))
            filmed = [each for each in sums if each]
            changes[split] = {name: change_of(each[name] for each in filmed) for name in (filmed[0] if filmed else ())}
    if scorer.worst is None:
        raise UserError(
            "no held-out camera has a photo: there is nothing to score on",
            file=scene.folder / "frames.arrow",
            remedy="hold out cameras with photos, under subjects.<name>.holdout in params.yaml",
        )
    return Evaluation(
        scores=scorer.scores,
        panels=scorer.panels,
        worst=scorer.worst,
        patch=scorer.patch,
        training=training_views(scene, asset, params),
        matte=scorer.kind,
        changes=changes,
        films=rolls.files,
    )


class _Scorer:
    """Renders and scores the frames of a camera.

    Attributes:
        keys: (camera, frame) of all photos that are scored, held-out cameras first.
        kind: which opacity says where the subject is in them.
        scores, panels, worst, patch: see `Evaluation`; of what has been scored.
    """

    def __init__(self, scene: Scene, asset: Asset, params: EvaluateParams, perceptual: Perceptual) -> None:
        self._scene, self._asset, self._params, self._perceptual = scene, asset, params, perceptual
        self._truths = Truths(scene)
        self._on_sheet = set(spread(range(scene.num_frames), params.sheet_frames))
        cameras = [index for split in SCORED for index in scene.indices(split)]
        self.keys = [(c, k) for c in cameras for k in range(scene.num_frames) if (c, k) in self._truths]
        self.kind = self._truths.matte_kind(self.keys)
        self.scores: list[ImageScore] = []
        self.panels: list[Panel] = []
        self.worst: Panel | None = None
        self.patch: WorstPatch | None = None

    def score(self, split: Split, index: int, view: PosedView, roll: FilmRoll | None, bar: Any) -> dict[str, Sums]:
        """All frames of a camera that have a photo; returns what changes in them, by variant.

        Args:
            roll: that the camera is filmed on.
            bar: of progress.
        """
        camera, background, film = self._scene.cameras[index], self._params.background, Film()
        frames = [k for c, k in self.keys if c == index]
        views = rendered(view, self._asset, frames)
        for k, renderings in in_order((partial(next, views) for _ in frames), threads=1):  # while others are scored
            frame, truth = self._scene.frame_ids[k], self._truths.at(index, k)
            _check_finite(renderings, camera.name, frame)
            pictures = {variant: shown(one.over(background)) for variant, one in renderings.items()}
            values = score_renderings(renderings, pictures, truth, self.kind, self._perceptual)
            group = {variant: ImageScore(camera.name, frame, variant, values[variant], split) for variant in values}
            self.scores += group.values()
            region = region_of(self.kind, truth, renderings)
            both = pictures["model"], pictures["asset"], group["model"], group["asset"]
            over = None if truth.plate is None else shown(renderings["asset"].over(truth.plate))
            panel = Panel(camera.name, frame, truth.picture, *both, region, over)
            if region is not None:
                film.add(k, pictures, truth.picture, region)
            if split == "holdout":
                self._keep(k, panel, renderings["asset"], truth)
            if roll is not None:
                roll.add(frame, truth.picture, panel.shown)
            bar.update()
        next(views, None)  # to the end of the video, whose frames are counted there
        return film.sums()

    def _keep(self, k: int, panel: Panel, asset: Rendering, truth: Truth) -> None:
        """What is kept of a held-out camera's picture: on the contact sheet, as the worst, its worst patch."""
        psnr = panel.asset_score.values["worst_patch"]
        self.worst = panel if self.worst is None else min(self.worst, panel, key=lambda one: one.rank)
        if psnr is not None and (self.patch is None or psnr < self.patch.place.psnr):
            self.patch = find_patch(panel.camera, panel.frame, asset, cutout_of(self.kind, truth))
        if k in self._on_sheet:
            self.panels.append(panel)


def rendered(view: PosedView, asset: Asset, frames: list[int]) -> Iterator[tuple[int, dict[str, Rendering]]]:
    """The variants' renderings of each of the `frames`; the asset's are decoded in one go if all have photos."""
    whole = len(frames) == asset.num_frames
    for k, textures in enumerate(asset.frames()) if whole else ((k, asset.frame(k)) for k in frames):
        view.turn(k)
        with_view, without_view, alpha = view.model.render(float(k))
        images = {
            "model": Rendering(with_view, alpha),
            "diffuse": Rendering(without_view, alpha),
            "asset": Rendering(*view.asset.composite(textures)),
            "asset_diffuse": Rendering(*view.asset.composite(textures, lit=False)),
        }
        yield k, images


def _check(scene: Scene, model: RadianceManifolds, asset: Asset) -> None:
    if not scene.indices("holdout"):
        raise UserError(
            "no held-out camera: there is nothing to score on",
            file=scene.folder / "scene.json",
            expected="at least one camera with split holdout",
            found=f"{len(scene.cameras)} cameras, all for training",
            remedy="name held-out cameras under subjects.<name>.holdout in params.yaml, or set {every: n} there",
        )
    check_frames("model", model.num_frames, scene)
    check_frames("asset", asset.num_frames, scene)


def _check_finite(images: Mapping[str, Rendering], camera: str, frame: str) -> None:
    for variant, image in images.items():
        if not (np.isfinite(image.rgb).all() and np.isfinite(image.alpha).all()):
            raise UserError(
                f"the rendering of the {variant} has numbers that are not finite",
                place=f"camera {camera}, frame {frame}",
                expected="colours in [0, 1]",
                found=f"{int((~np.isfinite(image.rgb)).any(-1).sum())} pixels with NaN or infinity",
                remedy="the model is damaged: train again with a smaller learning rate or another seed",
            )
