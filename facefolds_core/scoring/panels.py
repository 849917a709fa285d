"""Scores of one picture, and the picture itself: what evaluation hands to its sheet, its tables and its record."""

from __future__ import annotations

from dataclasses import dataclass

from facefolds_core.scoring.metrics import Array

VARIANTS = ("model", "diffuse", "asset")
WITH_EFFECTS = "asset_view"
"""A further variant, where the asset has view effects: the asset with them."""
METRICS = ("psnr", "ssim", "lpips", "st_lpips")
SUBJECT_METRICS = tuple(f"{name}_subject" for name in METRICS)


@dataclass(frozen=True)
class ImageScore:
    """One rendered image against the truth.

    Attributes:
        camera, frame: their names in the capture.
        variant: one of VARIANTS, or WITH_EFFECTS.
        values: METRICS and SUBJECT_METRICS; None where a value cannot be had.
    """

    camera: str
    frame: str
    variant: str
    values: dict[str, float | None]


@dataclass(frozen=True)
class Panel:
    """What the contact sheet shows of one camera and frame: images (H, W, 3) in [0, 1], and their scores.

    `mask` is the subject's opacity (H, W), or None where the capture has none.
    """

    camera: str
    frame: str
    truth: Array
    model: Array
    asset: Array
    model_score: ImageScore
    asset_score: ImageScore
    mask: Array | None = None

    @property
    def rank(self) -> tuple[bool, float]:
        """Least for the worst picture of the asset: by the subject's PSNR, and pictures without a subject last."""
        frame, subject = self.asset_score.values["psnr"], self.asset_score.values["psnr_subject"]
        return (subject is None, subject if subject is not None else frame or 0.0)
