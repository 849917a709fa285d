"""Rows of the page's tables: figures with the words and shares of bars that the template prints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from facefolds_core.asset.manifest import Manifest
from facefolds_core.files.reading import STAGE_OUTPUTS
from facefolds_core.geometry.cameras import Camera
from facefolds_core.reporting.charts import heat_colour, ink_on
from facefolds_core.reporting.facts import finite
from facefolds_core.reporting.words import count, duration, number, size
from facefolds_core.scoring.panels import VARIANTS, ImageScore

Row = dict[str, Any]

VARIANT_NAMES = {
    "model": "model",
    "diffuse": "model without view branch",
    "asset": "asset",
    "asset_diffuse": "asset without its reflection",
}
METRIC_NAMES = {"psnr": "PSNR, dB", "ssim": "SSIM", "lpips": "LPIPS", "st_lpips": "ST-LPIPS"}
HEAT_RANGE = 3.0
"""dB: the heat map's colours span at least so many, so that next to nothing does not look like much."""


def degrees_from_front(camera: Camera) -> float:
    """Of a camera as seen from the subject, which looks to +x."""
    cosine = float(camera.centre[0] / np.linalg.norm(camera.centre))
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def share(value: float | None, most: float) -> float:
    """Length of a bar, 0 to 100."""
    return 0.0 if value is None or most <= 0 else max(0.0, min(100.0, 100 * value / most))


GROUPS: dict[str, dict[str, tuple[str, int]]] = {
    "any background": {"psnr_any": ("PSNR, dB", 2), "worst_patch": ("worst patch, dB", 2)},
    "over time": {
        "psnr_moving": ("PSNR of what moves, dB", 2),
        "temporal": ("share explained", 2),
        "flicker": ("flicker", 4),
    },
    "error of opacity": {
        "opacity_inside": ("inside", 3),
        "opacity_edge": ("at the outline", 3),
        "opacity_outside": ("outside", 3),
    },
    "detail": {"ssim_high": ("SSIM of high frequencies", 3)},
    "over the plate": {"psnr_over_plate": ("PSNR, dB", 2), "ssim_over_plate": ("SSIM", 3)},
    "subject": {f"{key}_subject": (name, 2 if key == "psnr" else 3) for key, name in METRIC_NAMES.items()},
    "found matte": {f"{key}_found": (name, 2 if key == "psnr" else 3) for key, name in METRIC_NAMES.items()},
    "outline": {
        "psnr_interior": ("PSNR inside", 2),
        "psnr_band": ("PSNR along it", 2),
        "psnr_band_over_plate": ("along it, over the plate", 2),
    },
    "matte": {"matte_iou": ("IoU", 3), "matte_sad": ("SAD", 2)},
    "whole frame": {key: (name, 2 if key == "psnr" else 3) for key, name in METRIC_NAMES.items()},
}
"""Group -> metric -> its name and its digits; the whole frame comes last."""


def scores(metrics: dict[str, Any]) -> dict[str, Any]:
    """Means of each variant; metrics that nothing has are left out."""
    variants = [name for name in VARIANTS if name in metrics]
    groups, names, keys = [], [], []
    for group, listed in GROUPS.items():
        kept = [key for key in listed if any(finite(metrics[one].get(key)) is not None for one in variants)]
        if kept:
            groups.append({"name": group, "span": len(kept)})
            names += [listed[key][0] for key in kept]
            keys += [(key, listed[key][1]) for key in kept]
    rows = [
        {"name": VARIANT_NAMES[one], "values": [number(metrics[one].get(key), digits) for key, digits in keys]}
        for one in variants
    ]
    return {"groups": groups, "names": names, "rows": rows}


def heat_map(images: Sequence[ImageScore], key: str, places: dict[str, float]) -> Row:
    """PSNR of every held-out camera and frame."""
    values = {(image.camera, image.frame): image.values[key] for image in images}
    known = [value for value in values.values() if value is not None]
    low, high = (min(known), max(known)) if known else (0.0, 0.0)
    middle, half = (low + high) / 2, max(HEAT_RANGE, high - low) / 2
    frames = list(dict.fromkeys(image.frame for image in images))
    rows = []
    for camera in dict.fromkeys(image.camera for image in images):
        own = [value for frame in frames if (value := values.get((camera, frame))) is not None]
        cells = []
        for frame in frames:
            value = values.get((camera, frame))
            where = None if value is None else (value - middle + half) / (2 * half)
            cells.append(
                {
                    "value": number(value, 1),
                    "colour": None if where is None else heat_colour(where),
                    "ink": None if where is None else ink_on(where),
                }
            )
        note = f"{places[camera]:.0f}° from front" if camera in places else ""
        rows.append({"camera": camera, "note": note, "mean": number(np.mean(own) if own else None), "cells": cells})
    stops = ", ".join(heat_colour(i / 8) for i in range(9))
    return {
        "frames": frames,
        "rows": rows,
        "low": number(middle - half, 1),
        "high": number(middle + half, 1),
        "stops": stops,
    }


def levels(manifest: Manifest) -> list[Row]:
    """Levels of detail, the full one first."""
    rows = []
    for level in reversed(manifest.levels):
        texture = level.texture
        quality = level.quality.psnr_to_model if level.quality else None
        rows.append(
            {
                "name": level.name,
                "layers": count(len(level.layers)),
                "triangles": count(sum(layer.triangles for layer in level.layers)),
                "picture": f"{texture.width} × {texture.height}",
                "meshes": size(sum(layer.bytes for layer in level.layers)),
                "videos": ", ".join(f"{video.codec} {size(video.bytes)}" for video in texture.videos),
                "bytes": size(level.bytes),
                "quality": number(quality, 1),
            }
        )
    return rows


def stages(costs: Mapping[str, tuple[float | None, int | None]]) -> list[Row]:
    """Args: seconds and bytes by stage."""
    most_seconds, most_bytes = (max(cost[q] or 0 for cost in costs.values()) for q in (0, 1))
    return [
        {
            "name": name,
            "seconds": duration(seconds),
            "seconds_bar": share(seconds, most_seconds),
            "bytes": size(used),
            "bytes_bar": share(used, most_bytes),
            "what": ", ".join(STAGE_OUTPUTS[name]),
        }
        for name, (seconds, used) in costs.items()
    ]
