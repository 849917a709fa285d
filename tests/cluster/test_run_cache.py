"""What a killed DVC leaves in the run cache."""

from __future__ import annotations

import os
from pathlib import Path

from facefolds_core.cluster.run_cache import drop_empty_runs


def test_only_empty_folders_that_stay_so_are_removed(tmp_path: Path) -> None:
    full, empty, new = (tmp_path / "runs" / "68" / name for name in ("full", "empty", "new"))
    for folder in (full, empty, new):
        folder.mkdir(parents=True)
    (full / "entry").write_text("x")
    for folder in (full, empty):
        os.utime(folder, (0, 0))
    drop_empty_runs(tmp_path)
    assert sorted(path.name for path in (tmp_path / "runs" / "68").iterdir()) == ["full", "new"]
    drop_empty_runs(tmp_path / "none")
