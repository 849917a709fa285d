"""The table of a sweep: what is written is read again."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.cluster.table import Run, figures_of, write_runs
from facefolds_core.errors import UserError
from tests.cluster.tables import read_runs

RUNS = [
    Run(
        "one",
        "actor",
        "abc",
        {"decimate.resolution": 16, "compress.video.codec": "h264"},
        {"psnr": 24.5, "bytes": 1000.0},
    ),
    Run("two", "actor", "def", {"train.lr_texture": 0.5, "compress.video.codec": ["h264", "vp9"]}, {"psnr": 25.0}),
    Run("three", "anna", "012", {"decimate.resolution": 8, "sample.window": "full"}, {}, "out of memory, it says"),
]


@pytest.mark.parametrize("name", ["sweep.parquet", "sweep.csv"])
def test_round_trip(name: str, tmp_path: Path) -> None:
    """A null that was set is no missing value; a table may have no rows."""
    key = "compress.video.target_psnr"
    nulls = [Run("one", "a", params={key: None}), Run("two", "a", params={key: 40.0}), Run("three", "a")]
    for runs in (RUNS, nulls, []):
        write_runs(tmp_path / name, runs)
        assert read_runs(tmp_path / name) == runs


def test_another_kind_of_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="kind of table"):
        write_runs(tmp_path / "sweep.xlsx", RUNS)


def test_scores_for_validation_have_names_of_their_own() -> None:
    metrics = {
        "asset": {"psnr_subject": 30.0},
        "validate": {"images": 3, "asset": {"psnr_subject": 29.0, "ssim": None}},
    }
    figures = figures_of(metrics)
    assert (figures["psnr_subject"], figures["validate_psnr_subject"]) == (30, 29)
    assert "validate_ssim" not in figures


@pytest.mark.parametrize(("matte", "kept"), [("found", False), ("scene", True)])
def test_a_models_own_matte_is_no_judge(matte: str, kept: bool) -> None:
    figures = figures_of({"matte": matte, "asset": {"psnr_found": 20.0, "psnr": 10.0}})
    assert ("psnr_found" in figures, figures["psnr"]) == (kept, 10)
