"""The stage compress: from the files of the stages before it to an asset."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.validation import validate_asset
from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.errors import UserError
from facefolds_core.files import write_text
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.params import CompressParams
from facefolds_core.paths import SubjectFolders
from stages.compress import compress
from tests.assets import WINDOW, cap_crops, cap_mesh, cap_textures, radius_of, write_store

FROM_CAPTURE = Similarity(0.5, np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.array([0.1, -0.2, 0.3]))


@pytest.fixture
def folders(tmp_path: Path) -> SubjectFolders:
    """Three layers and two frames, as `normalize`, `sample`, `decimate` and `texture` leave them."""
    subject = SubjectFolders(tmp_path / "caps")
    write_text(subject.config / "compress.json", CompressParams().model_dump_json())
    write_scene(
        Scene("caps", (), (), ("a", "b"), np.arange(2) / 25, 25.0, FROM_CAPTURE, (), subject.scene), subject.scene
    )
    subject.samples.mkdir()
    np.savez(subject.samples / "grids.npz", windows=np.array([WINDOW] * 3))
    meshes = [cap_mesh(radius_of(layer)) for layer in range(3)]
    arrays = {f"{name}_{i:02d}": getattr(mesh, name) for i, mesh in enumerate(meshes) for name in vars(mesh)}
    subject.meshes.mkdir()
    np.savez(subject.meshes / "meshes.npz", **arrays)
    write_store(subject.textures / "textures.arrow", np.stack([cap_textures(3, frame, 64) for frame in range(2)]))
    return subject


def test_makes_a_sound_asset(folders: SubjectFolders) -> None:
    line = compress(folders)
    assert "3 of 3 meshes" in line and "2 frames" in line and str(folders.asset) in line
    assert validate_asset(folders.asset) == []
    manifest = read_asset(folders.asset).manifest
    assert (manifest.subject, manifest.full.texture.fps) == ("caps", 25.0)
    crops = cap_crops(3, 2, 64)
    assert [layer.uv_window for layer in manifest.full.layers] == [crop.window for crop in crops]


def test_to_capture_undoes_the_normalisation(folders: SubjectFolders) -> None:
    compress(folders)
    to_capture = read_asset(folders.asset).manifest.coordinates.to_capture.similarity()
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(to_capture.apply(FROM_CAPTURE.apply(points)), points, atol=1e-12)


@pytest.mark.parametrize(
    "file", ["meshes/meshes.npz", "samples/grids.npz", "textures/textures.arrow", "scene/scene.json"]
)
@pytest.mark.parametrize("damage", ["missing", "truncated"])
def test_damaged_input(folders: SubjectFolders, file: str, damage: str) -> None:
    path = folders.root / file
    data = path.read_bytes()
    path.unlink()
    if damage == "truncated":
        path.write_bytes(data[: len(data) // 2])
    with pytest.raises(UserError, match=path.name):
        compress(folders)
    assert not folders.asset.exists()


def test_fewer_meshes_than_windows(folders: SubjectFolders) -> None:
    np.savez(folders.samples / "grids.npz", windows=np.array([WINDOW] * 4))
    with pytest.raises(UserError, match="do not belong together"):
        compress(folders)
