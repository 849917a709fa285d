"""The table of a sweep: what is written is read again."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.errors import UserError
from facefolds_core.sweeps.table import Run, read_runs, write_runs

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


def test_mistakes(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="kind of table"):
        write_runs(tmp_path / "sweep.xlsx", RUNS)
    with pytest.raises(UserError, match="not found"):
        read_runs(tmp_path / "sweep.csv")
    (tmp_path / "sweep.parquet").write_bytes(b"nothing")
    with pytest.raises(UserError, match="not a table"):
        read_runs(tmp_path / "sweep.parquet")
    (tmp_path / "sweep.csv").write_text("psnr,experiment\n1,2\n")
    with pytest.raises(UserError, match="columns revision, subject, error"):
        read_runs(tmp_path / "sweep.csv")
    (tmp_path / "sweep.csv").write_text('experiment,revision,subject,error,psnr\n"a","b","c",,twelve\n')
    with pytest.raises(UserError, match="not a number"):
        read_runs(tmp_path / "sweep.csv")
