"""An asset beside that of another run: what is better, worse, or the same to the eye."""

from __future__ import annotations

from typing import Any

from facefolds_core.reporting.facts import finite
from facefolds_core.reporting.words import number, size

Row = dict[str, Any]

VERDICTS: dict[str, tuple[str, int, float, int]] = {
    "psnr_any": ("PSNR over any background, dB", 1, 0.05, 2),
    "worst_patch": ("PSNR of the worst patch, dB", 1, 0.2, 2),
    "psnr_moving": ("PSNR of what moves, dB", 1, 0.1, 2),
    "opacity_edge": ("error of opacity at the outline", -1, 0.002, 3),
    "psnr_over_plate": ("PSNR over the plate, dB", 1, 0.05, 2),
    "psnr_subject": ("PSNR of the subject, dB", 1, 0.05, 2),
    "psnr_interior": ("PSNR inside the outline, dB", 1, 0.05, 2),
    "psnr_band": ("PSNR along the outline, dB", 1, 0.05, 2),
    "ssim_subject": ("SSIM of the subject", 1, 0.002, 3),
    "st_lpips_subject": ("ST-LPIPS of the subject", -1, 0.002, 3),
    "matte_iou": ("IoU of the matte", 1, 0.002, 3),
    "temporal": ("change over time explained", 1, 0.01, 2),
    "flicker": ("flicker", -1, 0.0005, 4),
}
"""Metric -> its name, 1 where more is better and -1 where less is, the least change that is spoken of, digits."""


def verdicts(metrics: dict[str, Any], reference: dict[str, Any]) -> list[Row]:
    """The asset beside that of another run: each metric that both have, and then bytes."""
    rows = []
    for key, (name, sign, least, digits) in VERDICTS.items():
        now, before = finite(metrics["asset"].get(key)), finite((reference.get("asset") or {}).get(key))
        if now is not None and before is not None:
            better = sign * (now - before)
            rows.append(_verdict(name, number(before, digits), number(now, digits), better / least))
    sizes = [
        sum(finite((one.get("cost") or {}).get(part)) or 0.0 for part in ("mesh_bytes", "texture_bytes"))
        for one in (reference, metrics)
    ]
    if min(sizes) > 0:
        rows.append(_verdict("meshes and video", size(sizes[0]), size(sizes[1]), 100 * (1 - sizes[1] / sizes[0])))
    return rows


def _verdict(name: str, before: str, now: str, steps: float) -> Row:
    """`steps`: the change for the better, in units of the least that is spoken of."""
    word = "better" if steps >= 1 else "worse" if steps <= -1 else "the same"
    return {"name": name, "before": before, "now": now, "word": word}
