"""metrics.json and per_image.parquet."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.errors import UserError
from facefolds_core.facts import fact
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_json
from facefolds_core.scoring import report
from facefolds_core.scoring.panels import ALL_METRICS, FILM_METRICS, VARIANTS, ImageScore
from facefolds_core.scoring.report import EXPORT_STAGES, METRICS_VERSION, averages, headline, metrics_json, read_cost
from facefolds_core.scoring.temporal import Change
from tests.assets import cap_crops, make_asset
from tests.scoring.fakes import evaluation

COST_KEYS = [
    *("train_seconds", "iterations", "device", "export_seconds", "vertices", "triangles", "mesh_bytes"),
    *("texture_bytes", "video_bits_per_second", "reflection_bytes", "gpu_bytes"),
]
TRAINING = {"seconds": 12.5, "iterations": 300, "device": "cpu (2 threads)", "preset": "quick"}


def score(variant: str, frame: str, psnr: float, subject: float | None = None) -> ImageScore:
    values: dict[str, float | None] = dict.fromkeys(ALL_METRICS)
    return ImageScore("cam", frame, variant, values | {"psnr": psnr, "psnr_subject": subject})


SCORES = [score(v, f, p, s) for v in VARIANTS for f, p, s in (("0", 20.0, 10.0), ("1", 30.0, None), ("2", 25.0, 14.0))]


@pytest.fixture
def folders(tmp_path: Path) -> SubjectFolders:
    folders = SubjectFolders(tmp_path / "somebody")
    make_asset(folders.asset, layers=2, frames=2, resolution=32)
    write_json(folders.model / "training.json", TRAINING)
    for i, stage in enumerate(EXPORT_STAGES):
        write_json(folders.timing(stage), {"stage": stage, "seconds": 10.0**i})
    return folders


def test_averages_are_over_images_that_have_a_value() -> None:
    found = averages(SCORES, "asset")
    assert (found["psnr"], found["psnr_subject"], found["lpips"]) == (25, 12, None)
    patched = [replace(s, values={**s.values, "worst_patch": s.values["psnr"]}) for s in SCORES]
    assert averages(patched, "asset")["worst_patch"] == 20  # the least


def test_metrics_json_has_all_its_keys_and_no_nan(folders: SubjectFolders) -> None:
    cost = read_cost(folders, read_asset(folders.asset).manifest)
    write_json(folders.metrics, metrics_json("somebody", evaluation(SCORES), cost))
    metrics = json.loads(folders.metrics.read_text(), parse_constant=pytest.fail)
    about = ["headline", "matte", "band_pixels", "images", "images_with_mask", "truth_change"]
    places = ["worst_patch", "training_views"]
    assert list(metrics) == ["version", "subject", *about, *VARIANTS, *places, "warnings", "cost"]
    assert (metrics["version"], metrics["images"], metrics["images_with_mask"]) == (METRICS_VERSION, 3, 2)
    assert all(list(metrics[v]) == [*ALL_METRICS, *FILM_METRICS] for v in VARIANTS)
    assert list(metrics["cost"]) == COST_KEYS


def test_the_cost_adds_up(folders: SubjectFolders) -> None:
    manifest = read_asset(folders.asset).manifest
    cost = read_cost(folders, manifest)
    assert (cost["train_seconds"], cost["iterations"], cost["device"]) == (12.5, 300, "cpu (2 threads)")
    assert cost["export_seconds"] == 111111
    crops = cap_crops(2, 2, 32)
    assert cost["vertices"] == sum(len(crop.mesh.vertices) for crop in crops)
    assert cost["triangles"] == sum(len(crop.mesh.faces) for crop in crops)
    assert cost["mesh_bytes"] == sum(path.stat().st_size for path in folders.asset.glob("*_meshes.bin"))
    assert cost["texture_bytes"] == (folders.asset / "full.mp4").stat().st_size
    picture = manifest.full.texture.width * manifest.full.texture.height
    assert cost["gpu_bytes"] == 20 * cost["vertices"] + 12 * cost["triangles"] + 4 * picture


def test_per_image_scores_come_back_from_parquet(tmp_path: Path) -> None:
    report.write_per_image(SCORES, tmp_path / "scores.parquet")
    rows = pq.read_table(tmp_path / "scores.parquet").to_pylist()
    expected = [
        {"camera": s.camera, "frame": s.frame, "variant": s.variant, **s.values, "split": s.split} for s in SCORES
    ]
    assert rows == expected


@pytest.mark.parametrize("text", ["{", '{"seconds": 1}', '{"seconds": "x", "iterations": 1, "device": "cpu"}', "[]"])
def test_a_garbled_record_is_named(folders: SubjectFolders, text: str) -> None:
    (folders.model / "training.json").write_text(text)
    with pytest.raises(UserError) as error:
        read_cost(folders, read_asset(folders.asset).manifest)
    assert error.value.file == folders.model / "training.json"


def test_a_missing_timing_is_named(folders: SubjectFolders) -> None:
    folders.timing("decimate").unlink()
    with pytest.raises(UserError, match="file not found") as error:
        read_cost(folders, read_asset(folders.asset).manifest)
    assert error.value.file == folders.timing("decimate")


def test_cameras_for_validation_are_averaged_apart() -> None:
    checked = [replace(one, split="validate", values={**one.values, "psnr_subject": 33.0}) for one in SCORES]
    metrics = metrics_json("somebody", evaluation([*SCORES, *checked]), {})
    assert (metrics["images"], metrics["validate"]["images"]) == (3, 3)
    assert (metrics["asset"]["psnr_subject"], metrics["validate"]["asset"]["psnr_subject"]) == (12, 33)
    assert "validate" not in metrics_json("somebody", evaluation(SCORES), {})


@pytest.mark.parametrize(
    ("values", "best"),
    [
        ({"psnr": 1.0}, "psnr"),
        ({"psnr": 1.0, "psnr_found": 2.0}, "psnr_found"),
        ({"psnr": 1.0, "psnr_subject": 2.0}, "psnr_subject"),
        ({"psnr": 1.0, "psnr_subject": 2.0, "psnr_over_plate": 3.0}, "psnr_over_plate"),
        ({"psnr_over_plate": 3.0, "psnr_any": 2.0}, "psnr_any"),
        ({}, "psnr"),
    ],
)
def test_the_headline_is_what_says_most(values: dict[str, float], best: str) -> None:
    assert headline({"asset": values}) == best


def test_changes_and_warnings_are_in_it() -> None:
    changes = {"holdout": {"asset": Change(0.5, 20.0, 0.01, 0.1)}}
    metrics = metrics_json("somebody", evaluation(SCORES, changes=changes), {}, [fact("matte_is_found")])
    assert (metrics["asset"]["temporal"], metrics["asset"]["flicker"], metrics["truth_change"]) == (0.5, 0.01, 0.1)
    assert [one["kind"] for one in metrics["warnings"]] == ["matte_is_found"]
