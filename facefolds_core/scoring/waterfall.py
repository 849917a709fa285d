"""What each step of the export loses: from the model to the files that ship, as `evaluate` scores them.

It is measured on the cameras for validation, and on the held-out ones where no picture of those shows the subject,
over the pixels by which `evaluate` scores the subject: one kind of matte, chosen by all that it scores.

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
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import Scene, Split
from facefolds_core.errors import UserError
from facefolds_core.export.stores import read_grids
from facefolds_core.model import RadianceManifolds
from facefolds_core.params import EvaluateParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.progress import progress
from facefolds_core.rendering.areas import AreaView
from facefolds_core.scoring.detail import ssim_high
from facefolds_core.scoring.evaluation import frame_rate_factor, scored_keys
from facefolds_core.scoring.export_steps import Eye, Source, shipped_step, steps_on_disk
from facefolds_core.scoring.images import MASK_EDGE, Rendering, Values, region_of, region_scores, subject_box
from facefolds_core.scoring.metrics import psnr, shown
from facefolds_core.scoring.perceptual import Perceptual, PerceptualDistance
from facefolds_core.scoring.posed import PosedView
from facefolds_core.scoring.truths import MatteKind, Truths
from facefolds_core.spacing import spread

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


@dataclass(frozen=True)
class Waterfall:
    """What was measured.

    Attributes:
        region: which opacity says where the subject is, as in `Evaluation.matte`.
        split: which cameras took the pictures.
        images: number of pictures behind every mean.
        steps: all of `STEPS`, in order.
    """

    region: MatteKind
    split: Split
    images: int
    steps: list[Step]


def waterfall(
    scene: Scene,
    model: RadianceManifolds,
    folders: SubjectFolders,
    frames: int,
    st_lpips: PerceptualDistance | None,
    params: EvaluateParams | None = None,
) -> Waterfall:
    """Shows a progress bar.

    Args:
        folders: of the subject, with all export stages run.
        frames: of each camera at most, evenly spread over those that show the subject.
        st_lpips: None where it is not to be measured.
        params: what shows where a rendering is transparent; by default black.

    Raises:
        UserError: if a stage's file is missing or damaged, or there is no photo of the subject to compare with.
    """
    background = (EvaluateParams() if params is None else params).background
    grids, asset, truths = read_grids(folders.samples / "grids.npz"), read_asset(folders.asset), Truths(scene)
    factor = frame_rate_factor(scene, asset)
    sources = [*steps_on_disk(grids, model, folders), shipped_step(asset, factor)]
    perceptual = Perceptual(None, st_lpips, ())
    kind, split, keys = _chosen(scene, truths, frames)
    found: dict[str, list[Values]] = {name: [] for name in STEPS}
    with progress(total=len(keys), desc="waterfall", unit="image") as bar:
        for index, own in groupby(keys, key=lambda key: key[0]):
            posed = PosedView(scene, model, asset, scene.cameras[index], factor)
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
    return Waterfall(kind, split, len(found["model"]), _steps(found, sources, folders))


def _chosen(scene: Scene, truths: Truths, most: int) -> tuple[MatteKind, Split, list[tuple[int, int]]]:
    """Which opacity says where the subject is, and up to `most` pictures of each camera in which it does."""
    scored = scored_keys(scene, truths)
    kind = truths.matte_kind(scored)
    splits: tuple[Split, ...] = ("validate", "holdout")
    for split in splits:
        chosen = []
        for camera in scene.indices(split):
            own = [key for key in scored if key[0] == camera and _shows(truths, kind, key)]
            chosen += spread(own, most)
        if chosen:
            return kind, split, chosen
    raise _no_mask(scene, kind) if scored else _no_photo(scene)


def _shows(truths: Truths, kind: MatteKind, key: tuple[int, int]) -> bool:
    """Whether the subject is in a picture, as far as is known before the model is rendered."""
    region = truths.region(kind, *key)
    return kind == "found" or (region is not None and subject_box(region) is not None)


def _no_photo(scene: Scene) -> UserError:
    return UserError(
        "no camera for validation and no held-out one has a photo: there is nothing to compare the steps with",
        file=scene.folder / "frames.arrow",
        remedy="hold out cameras with photos, under subjects.<name>.holdout in params.yaml",
    )


def _no_mask(scene: Scene, kind: MatteKind) -> UserError:
    found = scene.mattes or scene.folder / "mattes.arrow"
    return UserError(
        f"no {'mask' if kind == 'true' else 'matte'} of a scored photo shows the subject: where to compare is unknown",
        file=scene.folder / "masks.arrow" if kind == "true" else found,
        expected=f"an opacity above {MASK_EDGE} somewhere",
        remedy="mend the capture's masks (or its mattes), or hold out cameras that have some with the subject, "
        "under subjects.<name>.holdout in params.yaml",
    )


def _rendered(
    scene: Scene, index: int, posed: PosedView, sources: Sequence[Source], frames: Sequence[int], lit: bool
) -> Iterator[tuple[int, dict[str, Rendering]]]:
    """Each of the frames by all steps; `lit`: the model with its reflection."""
    looks: dict[Callable[[Eye], AreaView], AreaView] = {}
    for k in frames:
        posed.turn(k)
        if not looks or scene.poses is not None:
            to_room = None if scene.poses is None else scene.poses.at(k).rotation
            eye = Eye(scene.camera_in_head(index, k), to_room, posed)
            looks = {look: look(eye) for look in dict.fromkeys(source.look for source in sources)}
        with_view, without_view, alpha = posed.model.render(float(k))
        renderings = {"model": Rendering(with_view if lit else without_view, alpha)}
        for source in sources:
            renderings[source.name] = Rendering(*looks[source.look].composite(source.textures(k)))
        yield k, renderings


def _steps(found: Mapping[str, Sequence[Values]], sources: Sequence[Source], folders: SubjectFolders) -> list[Step]:
    if not found["model"]:
        raise UserError(
            "the model is transparent in every picture: there is nothing to compare the steps with",
            file=folders.model,
            remedy="train again, or give the capture masks of the held-out cameras",
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
