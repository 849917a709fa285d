"""The README's table of scores."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.tools.scores import readme_table
from facefolds_core.errors import UserError
from facefolds_core.files.writing import write_json


def test_without_results_there_is_no_table(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no results"):
        readme_table(tmp_path)


def test_the_readme_has_a_row_a_subject(tmp_path: Path) -> None:
    scores = {"psnr": 11.0, "psnr_subject": 24.5, "psnr_interior": 25.0, "ssim_high": 0.875}
    sizes = {"triangles": 90702, "mesh_bytes": 219_000, "texture_bytes": 260_000, "reflection_bytes": 15_000}
    cost = {**sizes, "device": "cpu (2 threads)", "train_seconds": 60.4}
    metrics = {"headline": "psnr_subject", "asset": scores, "cost": cost}
    size = {"width": 128, "height": 192}
    cameras = [
        {"name": "A", "split": "train", **size, "w2c": [[0, 1, 0, 0], [0, 0, -1, 0], [-1, 0, 0, 1]]},
        {"name": "B", "split": "holdout", **size, "w2c": [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 1]]},
    ]
    write_json(tmp_path / "actor" / "metrics.json", metrics)
    write_json(tmp_path / "actor" / "scene" / "scene.json", {"cameras": cameras, "frame_ids": ["0", "1"]})
    write_json(tmp_path / "actor" / "model" / "training.json", {"preset": "quick"})
    assert readme_table(tmp_path).splitlines()[-1] == (
        "| `actor`, quick | **24.50** | of the subject | 25.00 |  | 0.875 | 2, 2, 192 x 128 | B (90) "
        "| 90 702 | 219 KB + 260 KB + 15 KB | 60 s |"
    )
