"""metrics.json in a few aligned lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from facefolds_core.captures.scene import Split
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.scoring.truths import MatteKind

NAME, CELL = 42, 12
"""Columns of the terminal: of a row's name, and of each figure."""

HEADLINE_WORDS = {
    "psnr_any": "over any background",
    "psnr_over_plate": "over the room's plate",
    "psnr_subject": "of the subject",
    "psnr_found": "within the matte that was found",
    "psnr": "over the whole frame",
}
"""Metric -> what it is taken over, on held-out cameras."""

NAMES = {"diffuse": "no gloss", "asset_diffuse": "no gloss"}
"""What the terminal calls variants, in few letters: each stands beside the one that it is a part of."""

SPLIT_WORDS: dict[Split, str] = {"train": "for training", "validate": "for validation", "holdout": "held out"}
"""What a camera is for, in words."""

REGION_WORDS: dict[MatteKind, str] = {"true": "the masks", "scene": "the mattes", "found": "the model's own opacity"}
"""What says where the subject is, in words."""

ROWS = (
    ("psnr_any", "PSNR over any background, dB", "{:.2f}"),
    ("worst_patch", "  of the worst patch of any picture", "{:.2f}"),
    ("psnr_moving", "PSNR of what moves, dB", "{:.2f}"),
    ("temporal", "change over time explained", "{:.0%}"),
    ("opacity_inside", "error of opacity inside the outline", "{:.3f}"),
    ("opacity_edge", "  along it", "{:.3f}"),
    ("opacity_outside", "  outside", "{:.3f}"),
    ("ssim_high", "SSIM of high frequencies", "{:.3f}"),
    ("psnr_over_plate", "PSNR over the room's plate, dB", "{:.2f}"),
    ("ssim_over_plate", "SSIM over the room's plate", "{:.3f}"),
    ("psnr_subject", "PSNR of the subject, dB", "{:.2f}"),
    ("psnr_interior", "  inside its outline", "{:.2f}"),
    ("psnr_band_over_plate", "  along its outline, over the plate", "{:.2f}"),
    ("psnr_band", "  along its outline", "{:.2f}"),
    ("ssim_subject", "SSIM of the subject", "{:.3f}"),
    ("lpips_subject", "LPIPS of the subject (0 is best)", "{:.3f}"),
    ("st_lpips_subject", "ST-LPIPS of the subject (0 is best)", "{:.3f}"),
    ("psnr_found", "PSNR within the found matte, dB", "{:.2f}"),
    ("ssim_found", "SSIM within the found matte", "{:.3f}"),
    ("lpips_found", "LPIPS within the found matte", "{:.3f}"),
    ("st_lpips_found", "ST-LPIPS within the found matte", "{:.3f}"),
    ("matte_iou", "matte: intersection over union", "{:.3f}"),
    ("flicker", "flicker of the error", "{:.4f}"),
    ("psnr", "PSNR of the whole frame, without the room", "{:.2f}"),
)
"""Metric -> its words and its form; the whole frame comes last: it rewards whoever paints the room."""


def score_lines(metrics: Mapping[str, Any]) -> list[str]:
    """The held-out cameras' means, and those of the cameras for validation."""
    lines = _lines(metrics, SPLIT_WORDS["holdout"])
    if isinstance(metrics.get("validate"), dict):
        lines += ["", *_lines(metrics["validate"], SPLIT_WORDS["validate"])]
    return lines


def _lines(metrics: Mapping[str, Any], what: str) -> list[str]:
    # Without a view branch the first two are the same figures twice.
    variants = ["model", *(["diffuse"] if metrics["diffuse"] != metrics["model"] else []), "asset"]
    if metrics.get("asset_diffuse") not in (None, metrics["asset"]):
        variants.append("asset_diffuse")
    lines = [_line(f"{metrics['images']} pictures {what}", [NAMES.get(name, name) for name in variants])]
    for key, words, form in ROWS:
        values = [metrics[variant].get(key) for variant in variants]
        if any(value is not None for value in values):
            lines.append(_line(words, ["-" if value is None else form.format(value) for value in values]))
    return lines


def _line(name: str, cells: list[str]) -> str:
    return f"{name:<{NAME}}" + "".join(f"{cell:>{CELL}}" for cell in cells)


def warning_lines(metrics: Mapping[str, Any]) -> list[str]:
    """What is not well, and what to do."""
    listed = [str(one.get("words", "")) for one in metrics.get("warnings", ()) if isinstance(one, dict)]
    return [line.removeprefix("warning: ").removeprefix("note: ") for line in listed if line]


def result_lines(metrics: Mapping[str, Any], folders: SubjectFolders) -> list[str]:
    """What there is to know at the end of a run: what is not well, where the asset is, what it weighs, how good it is,
    and how to look at it."""
    warnings = warning_lines(metrics)
    cost, key = metrics["cost"], metrics.get("headline", "psnr")
    size = sum(cost.get(name) or 0 for name in ("mesh_bytes", "texture_bytes", "reflection_bytes"))
    quality = metrics["asset"].get(key)
    good = "not scored" if quality is None else f"{quality:.2f} dB {HEADLINE_WORDS[key]}"
    return [
        *([f"\nwhat is not well ({len(warnings)}):"] if warnings else []),
        *(f"  {line}" for line in warnings),
        f"\n{metrics.get('subject', folders.root.name)}: {folders.asset}, {size / 1e6:.2f} MB, {good}",
        f"look at it:  make view ASSET={folders.asset}   (or: facefolds view {folders.asset})",
        "read of it:  make report",
    ]
