"""What `evaluate` writes: metrics.json and per_image.parquet (docs/reference/metrics.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from facefolds_core.asset.manifest import Manifest
from facefolds_core.captures.scene import Split
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_file, read_json
from facefolds_core.scoring.backgrounds import WorstPatch
from facefolds_core.scoring.matte import BAND
from facefolds_core.scoring.panels import ALL_METRICS, FILM_METRICS, HEADLINES, LEAST, VARIANTS, Evaluation, ImageScore
from facefolds_core.scoring.temporal import Change
from facefolds_core.scoring.training_scores import TrainingView, bad_views, compared_by

METRICS_VERSION = 2
EXPORT_STAGES = ("sample", "reconstruct", "decimate", "texture", "bake", "compress")

VERTEX_BYTES = 20
"""Position (3 float32) and texture coordinates (2 float32)."""
INDEX_BYTES = 4
PIXEL_BYTES = 4
"""RGBA8, what a decoded video frame takes on most graphics hardware."""

_DECIMALS = 5

T = TypeVar("T", bound=BaseModel)


class Timing(BaseModel):
    """What is read of timings/<stage>.json."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    seconds: Annotated[float, Field(ge=0)]


class Training(Timing):
    """What is read of model/training.json."""

    iterations: Annotated[int, Field(ge=0)]
    device: str


def metrics_json(
    subject: str, found: Evaluation, cost: dict[str, Any], warnings: Sequence[Fact] = ()
) -> dict[str, Any]:
    """The content of metrics.json: the held-out cameras first; those for validation apart, where there are any."""
    held, checked = (_means(found, split) for split in ("holdout", "validate"))
    content: dict[str, Any] = {
        "version": METRICS_VERSION,
        "subject": subject,
        "headline": headline(held),
        "matte": found.matte,
        "band_pixels": BAND,
        **held,
        "worst_patch": _patch(found.patch),
        "training_views": _training(found.training),
    }
    if checked["images"]:
        content["validate"] = {"headline": headline(checked), **checked}
    return {**content, "warnings": [one.to_json() for one in warnings], "cost": cost}


def _patch(patch: WorstPatch | None) -> dict[str, Any] | None:
    """Where the asset is worst: its PSNR, camera and frame, and the window's first pixel and side."""
    if patch is None:
        return None
    place = patch.place
    found = {"psnr": rounded(place.psnr), "camera": patch.camera, "frame": patch.frame}
    return found | {"row": place.row, "column": place.column, "side": place.side}


def _training(views: Sequence[TrainingView]) -> dict[str, Any] | None:
    """Of the training cameras: what they are compared by, means, the worst of them, and the bad ones."""
    name = compared_by(views)
    if name is None or not views:
        return None
    worst = min(views, key=lambda view: view.values[name] or 0.0)
    keys = dict.fromkeys(key for view in views for key in view.values)
    known = {key: [view.values[key] for view in views if view.values.get(key) is not None] for key in keys}
    return {
        "metric": name,
        "images": len(views),
        **{key: rounded(sum(of) / len(of)) if of else None for key, of in known.items()},  # type: ignore[arg-type]
        "worst": {"camera": worst.camera, "frame": worst.frame, "psnr": rounded(worst.values[name] or 0.0)},
        "bad": [view.camera for view in bad_views(views)],
    }


def headline(metrics: Mapping[str, Any]) -> str:
    """The metric of the asset that says most: the first of HEADLINES that it has."""
    values = metrics.get("asset") or {}
    return next((name for name in HEADLINES if isinstance(values.get(name), int | float)), HEADLINES[-1])


def _means(found: Evaluation, split: Split) -> dict[str, Any]:
    own = [score for score in found.scores if score.split == split]
    images = [score for score in own if score.variant == VARIANTS[0]]
    changes = found.changes.get(split, {})
    truth = next((change.truth_change for change in changes.values()), None)
    return {
        "images": len(images),
        "images_with_mask": sum(score.values["psnr_subject"] is not None for score in images),
        "truth_change": rounded(truth),
        **{variant: averages(own, variant, changes.get(variant)) for variant in VARIANTS},
    }


def averages(scores: Sequence[ImageScore], variant: str, change: Change | None = None) -> dict[str, float | None]:
    """Mean of each metric over the images that have it, of LEAST the least; None where none has. Then of films."""
    result: dict[str, float | None] = {}
    for name in ALL_METRICS:
        values = [v for s in scores if s.variant == variant and (v := s.values.get(name)) is not None]
        one = (min(values) if name in LEAST else sum(values) / len(values)) if values else None
        result[name] = rounded(one)
    return result | {name: rounded(getattr(change, name, None)) for name in FILM_METRICS}


def rounded(value: float | None) -> float | None:
    return None if value is None else round(value, _DECIMALS)


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
        "reflection_bytes": level.reflection.bytes if level.reflection else 0,
        "gpu_bytes": VERTEX_BYTES * vertices + 3 * INDEX_BYTES * triangles + PIXEL_BYTES * picture,
    }


def write_per_image(scores: Sequence[ImageScore], path: Path) -> None:
    """Parquet: camera, frame, variant (strings), then one float64 column a metric, null where it cannot be had; split.

    New columns come last.
    """
    columns: dict[str, pa.Array] = {
        name: pa.array([getattr(s, name) for s in scores], pa.string()) for name in ("camera", "frame", "variant")
    }
    for name in ALL_METRICS:
        columns[name] = pa.array([s.values.get(name) for s in scores], pa.float64())
    columns["split"] = pa.array([s.split for s in scores], pa.string())
    metadata = {"facefolds_metrics_version": str(METRICS_VERSION)}
    with atomic_file(path) as temporary:
        pq.write_table(pa.table(columns).replace_schema_metadata(metadata), temporary)


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
