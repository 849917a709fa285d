"""docs/reference/asset-format.md: its example is right, and it names every key. Its player: test_independent_reader."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.asset.colour import luma_to_alpha, yuv420_to_rgb
from facefolds_core.asset.packing import AtlasLayout
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import st_to_uv, uv_to_directions
from tests.assets import make_asset

TEXT = (Path(__file__).parents[2] / "docs" / "reference" / "asset-format.md").read_text(encoding="utf-8")


def test_example_rectangles() -> None:
    layout = AtlasLayout(2112, 3168, (0, 0, 2112, 1584), (0, 1584, 2112, 1584), ((532, 532, 512, 480),))
    assert layout.problems() == []
    place = np.array([532 + 0.3 * 512, 532 + 0.7 * 480])
    np.testing.assert_allclose(place, [685.6, 868.0])
    np.testing.assert_allclose(place / [2112, 3168], [0.324621, 0.273990], atol=5e-7)
    assert (place[1] + 1584) / 3168 == pytest.approx(0.773990, abs=5e-7)


def test_example_colour() -> None:
    planes = [np.full(shape, code, np.uint8) for shape, code in (((2, 2), 120), ((1, 1), 110), ((1, 1), 151))]
    assert yuv420_to_rgb(*planes)[0, 0].tolist() == [162, 113, 83]
    assert luma_to_alpha(np.array([[150]], np.uint8)).item() == 156


def test_example_point() -> None:
    uv = st_to_uv(np.array([0.3, 0.7]), (-0.5, 0.5, -0.4, 0.4))
    np.testing.assert_allclose(uv, [-0.2, -0.16])
    n = uv_to_directions(uv)
    np.testing.assert_allclose(n, [0.921177, -0.236518, -0.309017], atol=5e-7)
    point = np.array([-0.25, 0, 0]) + 0.25 * n
    np.testing.assert_allclose(point, [-0.019706, -0.059130, -0.077254], atol=6e-7)
    to_capture = Similarity(2.0, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(to_capture.apply(point), [0.218259, 0.160589, 0.145492], atol=6e-7)


def keys_of(value: Any) -> set[str]:
    if isinstance(value, dict):
        return set(value) | {key for inner in value.values() for key in keys_of(inner)}
    return {key for inner in value for key in keys_of(inner)} if isinstance(value, list) else set()


def test_it_names_every_key(tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=1, frames=1)
    manifest = json.loads((tmp_path / "asset" / "manifest.json").read_text())
    assert [key for key in sorted(keys_of(manifest)) if not re.search(rf"[`.]{key}\b", TEXT)] == []
