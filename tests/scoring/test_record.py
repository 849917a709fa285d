"""What was seen is read again as it was written, of the same asset only."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import Asset, read_asset
from facefolds_core.errors import UserError
from facefolds_core.scoring.panels import ImageScore, Panel
from facefolds_core.scoring.record import NAME, read_record, write_record
from tests.assets import make_asset


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    folder = tmp_path_factory.mktemp("asset") / "asset"
    make_asset(folder, layers=2, frames=1, resolution=32)
    return read_asset(folder)


def panel(frame: str, psnr: float, masked: bool = True) -> Panel:
    images = np.random.default_rng(int(frame)).integers(0, 256, (3, 4, 5, 3)) / 255
    score = ImageScore("a camera/..", frame, "asset", {"psnr": psnr, "psnr_subject": None})
    return Panel("a camera/..", frame, *images, score, score, images[0, ..., 0] if masked else None)


def test_it_comes_back(asset: Asset, tmp_path: Path) -> None:
    panels, worst = [panel("1", 20.0), panel("2", 21.0, masked=False)], panel("3", 10.0)
    write_record(tmp_path, panels, worst, asset)
    found = read_record(tmp_path, asset)
    assert found is not None
    assert found.worst == 2
    assert [(view.camera, view.frame, view.values["psnr"]) for view in found.views][2] == ("a camera/..", "3", 10.0)
    for view, one in zip(found.views, [*panels, worst], strict=True):
        np.testing.assert_array_equal(view.truth, one.truth)
        np.testing.assert_array_equal(view.asset, one.asset)
    assert found.views[1].mask is None
    np.testing.assert_array_equal(found.views[0].mask, panels[0].mask)


def test_a_worst_picture_of_the_sheet_is_kept_once(asset: Asset, tmp_path: Path) -> None:
    panels = [panel("1", 20.0), panel("2", 10.0)]
    write_record(tmp_path, panels, panels[1], asset)
    found = read_record(tmp_path, asset)
    assert found is not None
    assert (len(found.views), found.worst) == (2, 1)


def test_what_is_not_there_is_none(asset: Asset, tmp_path: Path) -> None:
    assert read_record(tmp_path, asset) is None


@pytest.mark.parametrize("text", ["{", "[]", '{"version": 9}', '{"version": 2}'])
def test_a_garbled_record_is_named(asset: Asset, tmp_path: Path, text: str) -> None:
    (tmp_path / NAME).write_text(text)
    with pytest.raises(UserError) as error:
        read_record(tmp_path, asset)
    assert error.value.file == tmp_path / NAME


def test_of_another_asset_it_is_refused(asset: Asset, tmp_path: Path) -> None:
    write_record(tmp_path, [], panel("1", 20.0), asset)
    make_asset(tmp_path / "other", layers=2, frames=2, resolution=32)
    with pytest.raises(UserError, match="another asset"):
        read_record(tmp_path, read_asset(tmp_path / "other"))


def test_a_damaged_picture_is_named(asset: Asset, tmp_path: Path) -> None:
    write_record(tmp_path, [], panel("1", 20.0), asset)
    shutil.copyfile(tmp_path / NAME, tmp_path / "pictures" / "000_asset.png")
    with pytest.raises(UserError, match="damaged") as error:
        read_record(tmp_path, asset)
    assert error.value.file == tmp_path / "pictures" / "000_asset.png"
