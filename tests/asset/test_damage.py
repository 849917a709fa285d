"""Whatever file of an asset is damaged, however, the validator names it."""

from __future__ import annotations

import shutil
import wave
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.validation import validate_asset
from facefolds_core.errors import UserError
from tests.asset.filmed import filmed, packaged
from tests.viewer.fixtures import random_reflection

FILES = [
    "manifest.json",
    *(f"{level}_meshes.bin" for level in ("small", "full")),
    *(f"{level}.{container}" for level in ("small", "full") for container in ("mp4", "webm")),
    *(f"{level}_reflection.png" for level in ("small", "full")),
    "audio.m4a",
    "poster.jpg",
    "photo_00.jpg",
]


READ = ("manifest.json", "full_meshes.bin", "full.mp4")
"""Of these the reader wants to know at once whether they are whole."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An asset with everything that one can have."""
    root = tmp_path_factory.mktemp("whole")
    scene = filmed(root / "scene")
    with wave.open(str(scene.folder / "audio.wav"), "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
        file.writeframes(bytes(3200))
    section = {
        "video": {"codec": ["h264", "vp9"], "crf": 24},
        "levels": [{"name": "small", "mesh_resolution": 6, "texture_resolution": 32, "crf": 30}],
        "photos": 1,
    }
    packaged(root / "asset", scene, section, random_reflection())
    return root / "asset"


def test_all_kinds_of_files_are_here_and_sound(whole: Path) -> None:
    assert sorted(file.name for file in whole.iterdir()) == sorted(FILES)
    assert validate_asset(whole) == []


@pytest.mark.parametrize("name", FILES)
def test_damage_is_named(whole: Path, tmp_path: Path, name: str) -> None:
    folder = Path(shutil.copytree(whole, tmp_path / "asset"))
    path, data = folder / name, (whole / name).read_bytes()
    rng = np.random.default_rng(len(name))
    flipped = bytearray(data)
    flipped[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
    for what, damaged in {"truncated": data[: len(data) // 2], "one byte short": data[:-1], "flipped": flipped}.items():
        path.write_bytes(damaged)
        assert any(problem.startswith(f"{name}:") for problem in validate_asset(folder)), what
        if name in READ:
            with pytest.raises(UserError):
                read_asset(folder)
    path.unlink()
    assert any(problem.startswith(f"{name}:") for problem in validate_asset(folder))
