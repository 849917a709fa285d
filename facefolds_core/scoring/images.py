"""All metrics of renderings of one view (docs/reference/metrics.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from facefolds_core.scoring.backgrounds import Cutout, Rendering, squared_error, worst_patch
from facefolds_core.scoring.matte import Region, interior_and_band, matte_errors, opacity_errors
from facefolds_core.scoring.metrics import Array, decibels, psnr, shown, ssim, ssim_high
from facefolds_core.scoring.panels import ALL_METRICS, FOUND_METRICS, METRICS, SUBJECT_METRICS
from facefolds_core.scoring.perceptual import Perceptual, PerceptualDistance
from facefolds_core.scoring.truths import MatteKind, Truth

MASK_EDGE = 0.1
"""The subject is where its opacity exceeds this: for the box of the perceptual metrics, and to tell an empty mask."""
MASK_MARGIN = 8
"""Pixels added to that box on each side, within the frame."""

Values = dict[str, float | None]


def score_renderings(
    renderings: Mapping[str, Rendering],
    pictures: Mapping[str, Array],
    truth: Truth,
    kind: MatteKind,
    perceptual: Perceptual,
) -> dict[str, Values]:
    """Every metric of every variant, `None` where it cannot be had.

    Args:
        renderings: by variant, "model" among them: it is what `found` goes by.
        pictures: the same over the background colour, as they are shown.
        kind: which opacity says where the subject is.
    """
    result = score_images(pictures, truth.picture, truth.mask, perceptual)
    cutout, region = cutout_of(kind, truth), region_of(kind, truth, renderings)
    found = {}
    if kind != "true" and region is not None:
        found = _measured(FOUND_METRICS, pictures, truth.picture, region, perceptual)
    parts = None if truth.mask is None else interior_and_band(truth.mask)
    for variant, one in renderings.items():
        values = result[variant]
        values |= found.get(variant, {})
        values["ssim_high"] = None if region is None else ssim_high(pictures[variant], truth.picture, region)
        if cutout is not None:
            values |= over_any(one, cutout)
        over = None if truth.plate is None else shown(one.over(truth.plate))
        if over is not None:
            values |= {"psnr_over_plate": psnr(over, truth.picture), "ssim_over_plate": ssim(over, truth.picture)}
        if truth.mask is not None and parts is not None:
            values |= matte_errors(one.opacity, truth.mask)
            values |= _outline(pictures[variant], over, truth.picture, truth.mask, *parts)
    return result


def region_of(kind: MatteKind, truth: Truth, renderings: Mapping[str, Rendering]) -> Array | None:
    """(H, W) opacity of the subject, as far as it is known."""
    if kind == "true":
        return truth.mask
    if kind == "scene":
        return truth.matte
    return renderings["model"].opacity


def cutout_of(kind: MatteKind, truth: Truth) -> Cutout | None:
    """The subject alone, as far as its opacity is known."""
    opacity = {"true": truth.mask, "scene": truth.matte}.get(kind)
    return None if opacity is None else Cutout.of(truth.picture, opacity, truth.plate)


def over_any(one: Rendering, cutout: Cutout) -> Values:
    """Over black, white, grey and the plate; and how far opacity is off."""
    error = squared_error(one.rgb, one.opacity, cutout)
    patch = worst_patch(error, cutout.opacity)
    any_background = {"psnr_any": decibels(float(error.mean())), "worst_patch": None if patch is None else patch.psnr}
    return any_background | opacity_errors(one.opacity, cutout.opacity)


def _outline(image: Array, over: Array | None, truth: Array, mask: Array, interior: Region, edge: Region) -> Values:
    """PSNR inside the outline and along it.

    Without a plate nobody knows what is behind a half-covered pixel: there the mask weighs.
    """
    return {
        "psnr_interior": psnr(image, truth, interior.astype(np.float64)),
        "psnr_band": psnr(image, truth, edge * mask),
        "psnr_band_over_plate": None if over is None else psnr(over, truth, edge.astype(np.float64)),
    }


def score_images(
    images: Mapping[str, Array], truth: Array, mask: Array | None, perceptual: Perceptual
) -> dict[str, Values]:
    """Metrics over the whole frame, and of the subject where its mask is known; all others None.

    Args:
        images: name -> (H, W, 3) in [0, 1].
        truth: (H, W, 3).
        mask: (H, W) opacity of the subject, or None.
    """
    whole = _measured(METRICS, images, truth, None, perceptual)
    within = {} if mask is None else _measured(SUBJECT_METRICS, images, truth, mask, perceptual)
    return {name: dict.fromkeys(ALL_METRICS) | whole[name] | within.get(name, {}) for name in images}


def _measured(
    names: Sequence[str], images: Mapping[str, Array], truth: Array, region: Array | None, perceptual: Perceptual
) -> dict[str, Values]:
    """METRICS of each image, by `names`; with a region weighted with it, perceptual ones of its box alone, and nothing
    where it is empty."""
    box = None if region is None else subject_box(region)
    if region is not None and box is None:
        return {}
    cut = [image if region is None else (image * region[..., None])[box] for image in [truth, *images.values()]]
    deep = (_distances(metric, cut[1:], cut[0]) for metric in (perceptual.lpips, perceptual.st_lpips))
    return {
        name: dict(zip(names, [psnr(image, truth, region), ssim(image, truth, region), *far], strict=True))
        for (name, image), *far in zip(images.items(), *deep, strict=True)
    }


def subject_box(mask: Array) -> tuple[slice, slice] | None:
    """Rows and columns of the subject with a margin; None where the mask is empty."""
    rows, columns = np.nonzero(mask > MASK_EDGE)
    if not len(rows):
        return None
    return (
        slice(max(0, rows.min() - MASK_MARGIN), rows.max() + 1 + MASK_MARGIN),
        slice(max(0, columns.min() - MASK_MARGIN), columns.max() + 1 + MASK_MARGIN),
    )


def _distances(metric: PerceptualDistance | None, images: list[Array], truth: Array) -> list[float | None]:
    if metric is None:
        return [None] * len(images)
    device = metric.shift.device
    stack = torch.tensor(np.stack([truth, *images]), dtype=torch.float32, device=device).permute(0, 3, 1, 2)
    return [float(d) for d in metric(stack[1:], stack[0])]
