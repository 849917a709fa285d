"""Strips of an asset from side to side."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.gate import strip
from tests.assets import make_asset


def test_a_row_a_colour_a_column_an_azimuth(tmp_path: Path) -> None:
    white, red = (1.0, 1.0, 1.0), (1.0, 0.0, 0.0)
    seen = strip(make_asset(tmp_path / "asset"), [-30, 0, 30], [white, red], (24, 32), 30.0)
    assert seen.shape == (2 * 32, 3 * 24, 3)
    assert (seen[0, ::24] == 255).all() and (seen[32, ::24] == (255, 0, 0)).all()  # corners show what is behind
    shown = (seen[:32].min(-1) < 250).reshape(32, 3, 24)
    assert shown.any((0, 2)).all() and not shown[:, :, 0].any()  # in each picture, and whole
    assert np.array_equal(seen[:32, ..., 0], seen[32:, ..., 0])  # red is behind both
