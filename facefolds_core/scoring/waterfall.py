"""What each step of the export loses: from the model to the files that ship, as `evaluate` scores them.

It is measured on the cameras for validation, and on the held-out ones where there are none.

Every step is rendered from what its stage left in data/<subject>: the steps are those of the asset that is there. All
are shown with the reflection that layers and frames share:
- the model with its own (`ModelView`);
- `sampled` to `baked` with the maps that `sample` took from it (`samples/grids.npz`): float32, before they are coded,
  looked up at each step's own hits by the reference renderer (`rendering.reflection`);
- `shipped` with the asset's, decoded from its picture of 8 bits.

Where the export has none, the model is shown without what depends on the direction: its view branch ships with nothing.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.export.stores import read_grids
from facefolds_core.model import RadianceManifolds
from facefolds_core.params import EvaluateParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.progress import progress
from facefolds_core.rendering import AssetCaster, composite
from facefolds_core.scoring.detail import ssim_high
from facefolds_core.scoring.evaluation import frame_rate_factor
from facefolds_core.scoring.export_steps import Eye, Source, shipped_step, steps_on_disk
from facefolds_core.scoring.images import Rendering, Values, region_of, region_scores
from facefolds_core.scoring.metrics import psnr, shown
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.scoring.posed import PosedView
from facefolds_core.scoring.truths import Truths

STEPS = ("model", "sampled", "meshed", "decimated", "resampled", "baked", "shipped")
"""The model; its sampled textures on its exact surfaces; on the reconstructed surfaces; on the decimated meshes;
textures resampled to R^t; textures fitted to the meshes; Draco, video, and the reflection in 8 bits."""


@dataclass(frozen=True)
class Step:
    """One step, mean over all images, against the photos, over the subject (docs/reference/metrics.md).

    Attributes:
        name: of STEPS.
        psnr: dB.
        psnr_to_model: against the step `model` in place of the photos; None for that step.
        triangles: of all layers; 0 where there are none.
        mesh_bytes, texture_bytes: of the files that ship, the reflection among the textures; before, of the bare arrays
            (positions, texture coordinates, indices; 8-bit RGBA of all frames).
        ssim, ssim_high: SSIM, and that of high frequencies.
        st_lpips: None where the package of its weights is not installed.
    """

    name: str
    psnr: float
    psnr_to_model: float | None
    triangles: int
    mesh_bytes: int
    texture_bytes: int
    ssim: float
    ssim_high: float
    st_lpips: float | None


def waterfall(
    scene: Scene,
    model: RadianceManifolds,
    folders: SubjectFolders,
    frames: Sequence[int],
    perceptual: Perceptual,
    params: EvaluateParams | None = None,
) -> list[Step]:
    """All steps of `STEPS`, in order; shows a progress bar.

    Args:
        folders: of the subject, with all export stages run.
        frames: indices of the frames that are rendered, where the camera has a photo.
        perceptual: of which ST-LPIPS is measured.
        params: what shows where a rendering is transparent; by default black.

    Raises:
        UserError: if a stage's file is missing or damaged, or there is no photo of the subject to compare with.
    """
    background = (EvaluateParams() if params is None else params).background
    grids, asset, truths = read_grids(folders.samples / "grids.npz"), read_asset(folders.asset), Truths(scene)
    factor = frame_rate_factor(scene, asset)
    sources = [*steps_on_disk(grids, model, folders), shipped_step(asset, factor)]
    caster, perceptual = AssetCaster(asset), replace(perceptual, lpips=None, cvvdp=None)
    keys = [(c, k) for c in scene.indices(scene.choice_split) for k in frames if (c, k) in truths]
    kind = truths.matte_kind(keys)
    found: dict[str, list[Values]] = {name: [] for name in STEPS}
    with progress(total=len(keys), desc="waterfall", unit="image") as bar:
        for index, own in groupby(keys, key=lambda key: key[0]):
            posed = PosedView(scene, model, asset, caster, scene.cameras[index], factor)
            numbers = [k for _, k in own]
            for k, renderings in _rendered(scene, index, posed, sources, numbers, grids.reflection is not None):
                truth = truths.at(index, k)
                pictures = {name: shown(one.over(background)) for name, one in renderings.items()}
                region = region_of(kind, truth, renderings)
                for name, values in region_scores(pictures, truth.picture, region, perceptual).items():
                    values["ssim_high"] = ssim_high(pictures[name], truth.picture, region)
                    values["psnr_to_model"] = psnr(pictures[name], pictures["model"], region)
                    found[name].append(values)
                bar.update()
    return _steps(found, sources, scene)


def _rendered(
    scene: Scene, index: int, posed: PosedView, sources: Sequence[Source], frames: Sequence[int], lit: bool
) -> Iterator[tuple[int, dict[str, Rendering]]]:
    """Each of the frames by all steps; `lit`: the model with its reflection."""
    looks = None
    for k in frames:
        posed.turn(k)
        if looks is None or scene.poses is not None:
            to_room = None if scene.poses is None else scene.poses.at(k).rotation
            eye = Eye(scene.camera_in_head(index, k), to_room, posed)
            looks = [source.look(eye) for source in sources]
        with_view, without_view, alpha = posed.model.render(float(k))
        renderings = {"model": Rendering(with_view if lit else without_view, alpha)}
        for source, (hits, added) in zip(sources, looks, strict=True):
            renderings[source.name] = Rendering(*composite(hits, source.textures(k), added=added))
        yield k, renderings


def _steps(found: Mapping[str, Sequence[Values]], sources: Sequence[Source], scene: Scene) -> list[Step]:
    if not found["model"]:
        raise UserError(
            "no photo shows the subject: there is nothing to compare the steps with",
            file=scene.folder / "frames.arrow",
            remedy="hold out cameras with photos, under subjects.<name>.holdout in params.yaml",
        )
    sizes = defaultdict(lambda: (0, 0, 0), {s.name: (s.triangles, s.mesh_bytes, s.texture_bytes) for s in sources})
    steps = []
    for name in STEPS:
        means = {metric: _mean([one[metric] for one in found[name]]) for metric in found[name][0]}
        to_model = None if name == "model" else means["psnr_to_model"]
        psnr_, ssim_, high = (means[metric] or 0.0 for metric in ("psnr", "ssim", "ssim_high"))
        steps.append(Step(name, psnr_, to_model, *sizes[name], ssim_, high, means["st_lpips"]))
    return steps


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
