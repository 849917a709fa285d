"""Scores and pictures: what evaluation hands to its sheet, its tables and its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from facefolds_core.captures.scene import Split
from facefolds_core.scoring.backgrounds import WorstPatch
from facefolds_core.scoring.films import FilmFile
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.temporal import Change
from facefolds_core.scoring.training_scores import TrainingView
from facefolds_core.scoring.truths import MatteKind

VARIANTS = ("model", "diffuse", "asset", "asset_diffuse")
"""The trained model, and without what depends on the view; the shipped files, and without their reflection."""
METRICS = ("psnr", "ssim", "lpips", "st_lpips")
SUBJECT_METRICS = tuple(f"{name}_subject" for name in METRICS)
FOUND_METRICS = tuple(f"{name}_found" for name in METRICS)
"""Within an opacity that is not the true one, where there is no true one."""
PLATE_METRICS = ("psnr_over_plate", "ssim_over_plate")
REGION_METRICS = ("psnr_interior", "psnr_band", "psnr_band_over_plate")
MATTE_METRICS = ("matte_sad", "matte_mse", "matte_gradient", "matte_iou")
ANY_METRICS = ("psnr_any", "worst_patch", "opacity_inside", "opacity_edge", "opacity_outside")
"""Over any background: colour and opacity together, and opacity alone."""
ALL_METRICS = (
    *(*METRICS, *SUBJECT_METRICS, *FOUND_METRICS, *PLATE_METRICS, *REGION_METRICS, *MATTE_METRICS),
    *(*ANY_METRICS, "ssim_high"),
)
"""Of each picture; docs/reference/metrics.md defines them."""
LEAST = ("worst_patch",)
"""Of these the least of all pictures is given in place of their mean."""
FILM_METRICS = ("temporal", "psnr_moving", "flicker")
"""Of each variant, over all frames of its cameras."""
HEADLINES = ("psnr_any", "psnr_over_plate", "psnr_subject", "psnr_found", "psnr")
"""The first that is there says most of the asset."""


@dataclass(frozen=True)
class ImageScore:
    """One rendered image against the truth.

    Attributes:
        camera, frame: their names in the capture.
        variant: one of VARIANTS.
        values: ALL_METRICS; None where a value cannot be had.
        split: of the camera.
    """

    camera: str
    frame: str
    variant: str
    values: dict[str, float | None]
    split: Split = "holdout"

    @property
    def headline(self) -> str:
        """The metric that says most of this picture."""
        return next((name for name in HEADLINES if self.values.get(name) is not None), HEADLINES[-1])


@dataclass(frozen=True)
class Panel:
    """What the contact sheet shows of one camera and frame: images (H, W, 3) in [0, 1], and their scores.

    `mask` is the subject's opacity (H, W) by which it is scored, None where none is known; `over` the asset over the
    camera's clean plate, where there is one.
    """

    camera: str
    frame: str
    truth: Array
    model: Array
    asset: Array
    model_score: ImageScore
    asset_score: ImageScore
    mask: Array | None = None
    over: Array | None = None

    @property
    def shown(self) -> Array:
        """The asset over the plate, else over the background colour."""
        return self.asset if self.over is None else self.over

    @property
    def rank(self) -> tuple[int, float]:
        """Least for the worst picture of the asset: by the metric that says most, pictures that lack it last."""
        key = self.asset_score.headline
        return HEADLINES.index(key), self.asset_score.values[key] or 0.0


@dataclass(frozen=True)
class Evaluation:
    """What was found.

    Attributes:
        scores: all of them, held-out cameras first.
        panels: of the contact sheet, held-out cameras alone.
        worst: the held-out picture on which the asset's PSNR is lowest (of the subject, where that is known).
        patch: the worst window of all held-out pictures of the asset; None where the subject's opacity is not known.
        training: what the training cameras see of the asset.
        matte: which opacity says where the subject is.
        changes: split -> variant -> what it shows of what changes from frame to frame.
        films: of the held-out cameras, where they were asked for.
    """

    scores: list[ImageScore]
    panels: list[Panel]
    worst: Panel
    patch: WorstPatch | None = None
    training: Sequence[TrainingView] = ()
    matte: MatteKind = "true"
    changes: Mapping[Split, Mapping[str, Change]] = field(default_factory=dict)
    films: Sequence[FilmFile] = ()
