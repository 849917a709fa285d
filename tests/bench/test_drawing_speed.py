"""Pictures a second of an asset, and a message where there is none."""

from pathlib import Path

import pytest

from bench.drawing_speed import pictures_a_second
from facefolds_core.errors import UserError
from facefolds_core.paths import SubjectFolders
from tests.viewer.fixtures import rich_asset


def test_an_asset_is_drawn(tmp_path: Path) -> None:
    rich_asset(tmp_path / "asset")
    pictures, renderer = pictures_a_second(SubjectFolders(tmp_path))
    assert pictures > 0
    assert renderer


def test_no_asset(tmp_path: Path) -> None:
    with pytest.raises(UserError):
        pictures_a_second(SubjectFolders(tmp_path))
