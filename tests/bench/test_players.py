"""What bench/players.py compares: splats of the same head, and its table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.players import VISIBLE, sample_splats, timing_table
from tests.assets import CENTRE, make_asset, radius_of


def test_splats_lie_on_the_layers_where_something_is_seen(tmp_path: Path) -> None:
    splats = sample_splats(make_asset(tmp_path / "asset", layers=2, frames=2, resolution=48), 500)
    assert splats.nbytes == 500 * 32
    radii = np.linalg.norm(splats["centre"] - np.array(CENTRE), axis=1)
    nearest = np.min([np.abs(radii - radius_of(layer)) for layer in range(2)], axis=0)
    assert nearest.max() < 0.01  # of flat triangles on spheres
    assert splats["rgba"][:, 3].min() >= np.floor(255 * VISIBLE)


def test_the_table_compares_with_the_first_row() -> None:
    floor = {"row": "floor", "size": "10x20", "milliseconds": 50.0, "processor": 40.0}
    ours = {"row": "ours, playing", "size": "10x20", "milliseconds": 100.0, "processor": 160.0}
    assert timing_table([floor, ours]).splitlines()[-1] == "| ours, playing | 100 | 10.0 | 160 | 4.0 |"
