"""One take that is trained in segments, for all tests of such takes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from facefolds_core.captures.scene import Scene, read_scene
from tests.training.takes import filmed, train


@pytest.fixture(scope="session")
def take(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Path]:
    """Trained in one process, not to be changed."""
    folder = tmp_path_factory.mktemp("take")
    scene = filmed(folder / "scene")
    train(scene, folder, processes=1)
    return scene, folder


@pytest.fixture
def take_again(take: tuple[Scene, Path], tmp_path: Path) -> tuple[Scene, Path]:
    """The same take with what a finished training leaves, in a folder of its own."""
    shutil.copytree(take[1], tmp_path / "take")
    return read_scene(tmp_path / "take" / "scene"), tmp_path / "take"


@pytest.fixture
def unfitted(take_again: tuple[Scene, Path]) -> tuple[Scene, Path]:
    """The same, with its base and no segment."""
    for path in (take_again[1] / "checkpoints" / "take").glob("segment-*"):
        path.unlink()
    return take_again
