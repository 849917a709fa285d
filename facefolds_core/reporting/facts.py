"""What the pipeline's files say about one subject. What a file would say that is not there is None or empty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.reading import STAGE_OUTPUTS, check_regular, is_there, no_memory
from facefolds_core.files.writing import read_json
from facefolds_core.scoring.panels import HEADLINES, ImageScore

REMEDY = "make it with `dvc repro` (on a fresh machine: `make repro`)"


@dataclass(frozen=True)
class Facts:
    """All that is read.

    Attributes:
        metrics: metrics.json.
        images: HEADLINES of the asset on each held-out image; empty without evaluation/per_image.parquet.
        fit: model/fit.json, of presets that fit the scene first.
        curves: the training log.
        stages: seconds and bytes of each, in the order in which they run.
        config: the subject's parameters, by section.
    """

    metrics: dict[str, Any]
    images: tuple[ImageScore, ...]
    fit: dict[str, Any] | None
    curves: dict[str, list[tuple[float, float]]]
    stages: dict[str, tuple[float | None, int | None]]
    config: dict[str, dict[str, Any]]


def read_facts(folders: SubjectFolders) -> Facts:
    """Read them all.

    Raises:
        UserError: if the folder is not a subject's that has been evaluated, or a file is garbled.
    """
    if not folders.metrics.is_file():
        raise UserError(
            "not the folder of a subject that has been evaluated",
            file=folders.root,
            expected="metrics.json in it",
            found="no such file" if folders.root.is_dir() else "no such folder",
            remedy=f"name a folder like data/actor; if nothing is in it yet, {REMEDY}",
        )
    metrics = read_metrics(folders.metrics)
    return Facts(
        metrics=metrics,
        images=read_images(folders.evaluation / "per_image.parquet"),
        fit=read_mapping(folders.model / "fit.json"),
        curves=read_curves(folders.training_log / "plots" / "metrics"),
        stages={name: (seconds_of(folders, name), bytes_of(folders, name)) for name in STAGE_OUTPUTS},
        config={path.stem: read_mapping(path) or {} for path in sorted(folders.config.glob("*.json"))},
    )


def read_metrics(path: Path) -> dict[str, Any]:
    """A metrics.json.

    Raises:
        UserError: if it is missing or garbled.
    """
    metrics = read_mapping(path)
    if metrics is None:
        raise UserError("file not found", file=path, expected="a metrics.json", remedy=REMEDY)
    for part in ("asset", "cost"):
        if not isinstance(metrics.get(part), dict):
            raise UserError(
                "garbled file", file=path, place=part, expected="a JSON object", found=metrics.get(part), remedy=REMEDY
            )
    return metrics


def read_mapping(path: Path) -> dict[str, Any] | None:
    """The object in a JSON file; None where there is no such file.

    Raises:
        UserError: if it is not JSON, or no object.
    """
    if not is_there(path):
        return None
    value = read_json(path, remedy=REMEDY)
    if not isinstance(value, dict):
        found = type(value).__name__
        raise UserError("garbled file", file=path, expected="a JSON object", found=found, remedy=REMEDY)
    return value


def read_images(path: Path) -> tuple[ImageScore, ...]:
    """The asset's rows of per_image.parquet on held-out cameras, in the file's order; empty where it is not there.

    Raises:
        UserError: if it is damaged or lacks columns.
    """
    if not is_there(path):
        return ()
    check_regular(path, REMEDY)
    columns = ["camera", "frame", "variant", "psnr", "psnr_subject"]
    more = ["psnr_found", "psnr_over_plate", "psnr_any", "split"]
    try:
        known = pq.read_schema(path).names
        rows = pq.read_table(path, columns=[*columns, *(name for name in more if name in known)]).to_pylist()
    except MemoryError:
        raise no_memory(path) from None
    except (pa.ArrowException, OSError, KeyError, ValueError, TypeError, OverflowError) as error:
        raise UserError("damaged scores", file=path, found=str(error), remedy=REMEDY) from None
    return tuple(
        ImageScore(row["camera"], row["frame"], "asset", {name: finite(row.get(name)) for name in HEADLINES})
        for row in rows
        if row["variant"] == "asset" and row.get("split", "holdout") == "holdout"
    )


def finite(value: Any) -> float | None:
    """A number as it is; None for anything else, NaN and infinity among it."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def read_curves(folder: Path) -> dict[str, list[tuple[float, float]]]:
    """Every series of dvclive's log, PSNR first: (step, value); lines without two finite numbers are left out."""
    curves = {}
    for path in sorted(folder.rglob("*.tsv"), key=lambda path: (path.stem != "psnr", path)):
        rows = np.genfromtxt(path, delimiter="\t", skip_header=1, usecols=(0, -1), invalid_raise=False).reshape(-1, 2)
        if len(points := rows[np.isfinite(rows).all(1)]) > 1:
            curves[path.relative_to(folder).with_suffix("").as_posix()] = list(map(tuple, points.tolist()))
    return curves


def seconds_of(folders: SubjectFolders, stage: str) -> float | None:
    """Wall clock of a stage's last run."""
    return finite((read_mapping(folders.timing(stage)) or {}).get("seconds"))


def bytes_of(folders: SubjectFolders, stage: str) -> int | None:
    """Of all that a stage left on disk; None where nothing is there."""
    outputs = [path for name in STAGE_OUTPUTS[stage] if (path := folders.root / name).exists()]
    files = [file for path in outputs for file in (path, *path.rglob("*")) if file.is_file()]
    return sum(file.stat().st_size for file in files) if outputs else None
