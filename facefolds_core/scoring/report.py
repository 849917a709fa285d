"""What `evaluate` writes: metrics.json and per_image.parquet (docs/reference/metrics.md); a table for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from facefolds_core.asset.manifest import Manifest
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file, read_json
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.panels import METRICS, SUBJECT_METRICS, VARIANTS, WITH_EFFECTS, ImageScore

METRICS_VERSION = 1
EXPORT_STAGES = ("sample", "reconstruct", "decimate", "texture", "bake", "compress")

VERTEX_BYTES = 20
"""Position (3 float32) and texture coordinates (2 float32)."""
INDEX_BYTES = 4
PIXEL_BYTES = 4
"""RGBA8, what a decoded video frame takes on most graphics hardware."""

_DECIMALS = 5

T = TypeVar("T", bound=BaseModel)


class Training(BaseModel):
    """What is read of model/training.json."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    seconds: Annotated[float, Field(ge=0)]
    iterations: Annotated[int, Field(ge=0)]
    device: str


class Timing(BaseModel):
    """What is read of timings/<stage>.json."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    seconds: Annotated[float, Field(ge=0)]


def metrics_json(subject: str, scores: Sequence[ImageScore], cost: dict[str, Any]) -> dict[str, Any]:
    """The content of metrics.json."""
    images = [s for s in scores if s.variant == VARIANTS[0]]
    return {
        "version": METRICS_VERSION,
        "subject": subject,
        "images": len(images),
        "images_with_mask": sum(s.values["psnr_subject"] is not None for s in images),
        **{variant: averages(scores, variant) for variant in _variants(scores)},
        "cost": cost,
    }


def _variants(scores: Sequence[ImageScore]) -> tuple[str, ...]:
    return (*VARIANTS, WITH_EFFECTS) if any(s.variant == WITH_EFFECTS for s in scores) else VARIANTS


def averages(scores: Sequence[ImageScore], variant: str) -> dict[str, float | None]:
    """Mean of each metric over the images that have it; None where no image has."""
    result: dict[str, float | None] = {}
    for name in (*METRICS, *SUBJECT_METRICS):
        values = [v for s in scores if s.variant == variant and (v := s.values[name]) is not None]
        result[name] = round(sum(values) / len(values), _DECIMALS) if values else None
    return result


def read_cost(folders: SubjectFolders, manifest: Manifest) -> dict[str, Any]:
    """The section `cost`: time and device from the stages' own records, sizes from the asset's manifest.

    Raises:
        UserError: if a record is missing or garbled.
    """
    training = _read(Training, folders.model / "training.json")
    timings = [_read(Timing, folders.timing(stage)) for stage in EXPORT_STAGES]
    return {
        "train_seconds": round(training.seconds, 3),
        "iterations": training.iterations,
        "device": training.device,
        "export_seconds": round(sum(t.seconds for t in timings), 3),
        **asset_cost(manifest),
    }


def asset_cost(manifest: Manifest) -> dict[str, int]:
    """What the full level costs a player (docs/reference/metrics.md, `cost`)."""
    level = manifest.full
    vertices, triangles = sum(x.vertices for x in level.layers), sum(x.triangles for x in level.layers)
    picture = level.texture.width * level.texture.height
    video = level.texture.videos[0].bytes
    return {
        "vertices": vertices,
        "triangles": triangles,
        "mesh_bytes": sum(x.bytes for x in level.layers),
        "texture_bytes": video,
        "video_bits_per_second": round(8 * video * level.texture.fps / level.texture.frames),
        "view_effects_bytes": level.view_effects.bytes if level.view_effects else 0,
        "gpu_bytes": VERTEX_BYTES * vertices + 3 * INDEX_BYTES * triangles + PIXEL_BYTES * picture,
    }


def write_per_image(scores: Sequence[ImageScore], path: Path) -> None:
    """Parquet: camera, frame, variant (strings), then one float64 column a metric, null where it cannot be had."""
    columns: dict[str, pa.Array] = {
        name: pa.array([getattr(s, name) for s in scores], pa.string()) for name in ("camera", "frame", "variant")
    }
    for name in (*METRICS, *SUBJECT_METRICS):
        columns[name] = pa.array([s.values[name] for s in scores], pa.float64())
    metadata = {"facefolds_metrics_version": str(METRICS_VERSION)}
    with atomic_file(path) as temporary:
        pq.write_table(pa.table(columns).replace_schema_metadata(metadata), temporary)


def text_table(metrics: dict[str, Any]) -> str:
    """The averages as a small table, one line a variant; metrics that nothing has are left out."""
    variants = [v for v in (*VARIANTS, WITH_EFFECTS) if v in metrics]
    names = [n for n in (*METRICS, *SUBJECT_METRICS) if any(metrics[v][n] is not None for v in variants)]
    lines = ["".join([f"{'':<11}", *(f"{name:>18}" for name in names)])]
    for variant in variants:
        cells = [
            "-" if (v := metrics[variant][n]) is None else f"{v:.2f}" if "psnr" in n else f"{v:.4f}" for n in names
        ]
        lines.append("".join([f"{variant:<11}", *(f"{cell:>18}" for cell in cells)]))
    return "\n".join(lines)


def _read(kind: type[T], path: Path) -> T:
    remedy = "run `dvc repro`: the stage that writes it will run again"
    value = read_json(path, remedy=remedy)
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UserError(
            "garbled record of a stage", file=path, place=place or None, expected=first["msg"], remedy=remedy
        ) from None
