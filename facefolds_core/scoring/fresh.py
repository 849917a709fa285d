"""Scores on new views of the embedded actor, by the angle from which it is seen (docs/reference/metrics.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from facefolds_core.asset import Asset
from facefolds_core.captures.actor.fresh import film_fresh_views
from facefolds_core.captures.scene import Scene
from facefolds_core.model import RadianceManifolds
from facefolds_core.params import CaptureParams, EvaluateParams
from facefolds_core.progress import progress
from facefolds_core.scoring.evaluation import frame_rate_factor, rendered
from facefolds_core.scoring.images import score_renderings
from facefolds_core.scoring.panels import VARIANTS, ImageScore
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.scoring.posed import PosedView
from facefolds_core.scoring.report import averages, rounded
from facefolds_core.scoring.truths import Truth

BAND_EDGES = (0, 20, 40, 60, 75)
"""Degrees of azimuth to either side."""
KEPT = ("psnr_subject", "ssim_subject", "psnr_interior", "psnr_band", "matte_iou")
NO_WEIGHTS = Perceptual(None, None, ())


@dataclass(frozen=True)
class FreshScore:
    """A new view: degrees, and its scores by variant."""

    azimuth: float
    elevation: float
    scores: tuple[ImageScore, ...]


def score_fresh_views(
    scene: Scene, model: RadianceManifolds, asset: Asset, params: EvaluateParams, capture: CaptureParams
) -> list[FreshScore]:
    """Film and score `params.fresh_views` views; shows a progress bar."""
    step = frame_rate_factor(scene, asset)
    found = []
    with progress(total=params.fresh_views, desc="fresh views", unit="image") as bar:
        for view in film_fresh_views(scene, capture, params.fresh_views):
            posed = PosedView(scene, model, asset, view.camera, step)
            truth = Truth(view.rgb / 255.0, mask=view.opacity)
            for _, _, images in rendered(posed, asset, [view.frame], step):
                values = score_renderings(images, truth, "true", params.background, params.band, NO_WEIGHTS)
            frame = scene.frame_ids[view.frame]
            scores = tuple(ImageScore(view.camera.name, frame, variant, values[variant]) for variant in values)
            found.append(FreshScore(view.azimuth, view.elevation, scores))
            bar.update()
    return found


def fresh_json(views: Sequence[FreshScore]) -> dict[str, Any]:
    """`fresh_views` of metrics.json: means, the worst, and PSNR of the subject by azimuth to either side."""
    scores = [score for view in views for score in view.scores]
    worst = min(views, key=lambda view: _psnr(view, "asset"))
    bands = []
    for low, high in pairwise(BAND_EDGES):
        own = [view for view in views if low <= abs(view.azimuth) < high]
        means = {name: rounded(float(np.mean([_psnr(v, name) for v in own]))) if own else None for name in VARIANTS}
        bands.append({"low": low, "high": high, "images": len(own), "psnr_subject": means})
    return {
        "images": len(views),
        **{name: {key: value for key, value in averages(scores, name).items() if key in KEPT} for name in VARIANTS},
        "worst": {
            "azimuth": round(worst.azimuth, 1),
            "elevation": round(worst.elevation, 1),
            "psnr_subject": rounded(_psnr(worst, "asset")),
        },
        "bands": bands,
    }


def _psnr(view: FreshScore, variant: str) -> float:
    """Of the subject, dB; 0 where nothing of it is seen, which the rig rules out."""
    return next(score.values["psnr_subject"] or 0.0 for score in view.scores if score.variant == variant)
