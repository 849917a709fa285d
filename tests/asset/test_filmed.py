"""The range of directions that was filmed, as the manifest has it."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from facefolds_core.asset.filmed import (
    FREE,
    ROUND,
    degrees_beyond,
    direction_of,
    filmed_view,
    swing_filmed,
    unfilmed_words,
)
from facefolds_core.asset.manifest_extras import FilmedView
from facefolds_core.asset.manifest_file import SCHEMA_PATH, parse_manifest
from facefolds_core.errors import UserError
from tests.assets import make_asset
from tests.scenes import look_at_origin
from tests.viewer.fixtures import change_manifest


def cameras(*directions: tuple[float, float]) -> list:
    return [look_at_origin(f"c{i}", azimuth, elevation, 64) for i, (azimuth, elevation) in enumerate(directions)]


def test_the_range_holds_all_cameras() -> None:
    assert filmed_view([]) is None
    found = filmed_view(cameras((-50, 0), (30, -12), (70, 25)))
    assert np.allclose([found.azimuth, found.elevation], [(-50, 70), (-12, 25)], atol=0.01)


def test_an_arc_behind_the_subject_goes_through_the_back() -> None:
    low, high = filmed_view(cameras((150, 0), (-150, 0), (179, 0))).azimuth
    assert high - low == pytest.approx(60, abs=0.02)
    assert (low + 360) % 360 == pytest.approx(150, abs=0.01)


def test_cameras_all_round_leave_the_widest_gap_out() -> None:
    low, high = filmed_view(cameras(*((20 + 30 * k, 0) for k in range(11)))).azimuth  # none at 350
    assert high - low == pytest.approx(300, abs=0.02)


FRONT = FilmedView(azimuth=(-60, 50), elevation=(-10, 20))
BACK = FilmedView(azimuth=(150, 210), elevation=(0, 0))
ALL_ROUND = FilmedView(azimuth=(-155, 150), elevation=(0, 0))


@pytest.mark.parametrize(
    ("view", "azimuth", "elevation", "expected"),
    [
        (FRONT, 0, 0, 0),
        (FRONT, 50 + FREE, 0, 0),  # as good as filmed
        (FRONT, 80, 0, 30 - FREE),
        (FRONT, 180, 0, 120 - FREE),  # to the nearer end
        (FRONT, -425, 0, 5 - FREE),
        (FRONT, 0, -40, 30 - FREE),
        (FRONT, 80, 60, 40 - FREE),
        (BACK, -170, 0, 0),
        (BACK, 140, 0, 10 - FREE),
        (ALL_ROUND, 175, 0, 0),
        (ALL_ROUND, 175, 30, 30 - FREE),
    ],
)
def test_how_far_beyond(view: FilmedView, azimuth: float, elevation: float, expected: float) -> None:
    assert degrees_beyond(view, azimuth, elevation) == pytest.approx(expected)
    told = unfilmed_words(view, [(azimuth, elevation)])
    assert told is None if expected == 0 else told is not None and f" {expected + FREE:.0f} degrees beyond" in told


def test_how_far_a_camera_may_swing() -> None:
    assert swing_filmed(FRONT, 10, 5, 55, 18) == ((55, 40 + FREE), (18, 18))
    assert swing_filmed(FRONT, 0, 12, 55, 18) == ((55, 50 + FREE), (18, 8 + FREE))
    assert swing_filmed(FRONT, 90, 0, 55, 18) == ((55, 55), (18, 18))  # it is beyond already
    assert swing_filmed(ALL_ROUND, 160, 0, 55, 18) == ((55, 55), (FREE, FREE))
    assert swing_filmed(BACK, -170, 0, 55, 18)[0] == (40 + FREE, 20 + FREE)


def test_the_direction_of_a_camera() -> None:
    (camera,) = cameras((120, -20))
    assert direction_of(camera) == pytest.approx((120, -20))
    assert filmed_view([camera], [camera]) is not None


def test_the_player_takes_the_same_margins(project_root: Path) -> None:
    source = (project_root / "viewer" / "src" / "limits.js").read_text(encoding="utf-8")
    assert f"NEAR = {FREE:g};" in source and f"ROUND = {ROUND:g};" in source


def test_the_key_is_optional_and_checked(tmp_path: Path) -> None:
    folder = tmp_path / "asset"
    make_asset(folder, frames=1)
    schema = jsonschema.Draft202012Validator(json.loads(SCHEMA_PATH.read_text()))
    path = folder / "manifest.json"
    assert "view" not in json.loads(path.read_text())
    change_manifest(folder, lambda value: value.update(view={"azimuth": [-40, 60.5], "elevation": [0, 10]}))
    schema.validate(json.loads(path.read_text()))
    assert parse_manifest(path).view == FilmedView(azimuth=(-40, 60.5), elevation=(0, 10))
    for bad in ({"azimuth": [10, -10], "elevation": [0, 0]}, {"azimuth": [0, 1]}, None):
        path.write_text(json.dumps(json.loads(path.read_text()) | {"view": bad}))
        with pytest.raises(UserError, match="view"):
            parse_manifest(path)
