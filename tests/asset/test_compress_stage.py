"""The stage compress: from the files of the stages before it to an asset."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.draco import encode_mesh
from facefolds_core.asset.filmed import filmed_view
from facefolds_core.asset.validation import validate_asset
from facefolds_core.captures.scene import Scene, read_scene, write_scene
from facefolds_core.errors import UserError
from facefolds_core.export.stores import write_meshes
from facefolds_core.files.frame_store import write_frames
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_text
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.packaging.poster import BACKGROUND
from facefolds_core.packaging.settings import LEAST_QUALITY
from facefolds_core.params import CompressParams, merged
from facefolds_core.pipeline.compress import compress
from tests.assets import CENTRE, PLAIN, WINDOW, cap_crops, cap_mesh, cap_textures, radius_of, write_store
from tests.captures.fixtures import save_wav
from tests.scenes import look_at_origin

FROM_CAPTURE = Similarity(0.5, np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.array([0.1, -0.2, 0.3]))


@pytest.fixture
def folders(tmp_path: Path) -> SubjectFolders:
    """Three layers and two frames, as `normalize`, `sample`, `decimate` and `texture` leave them."""
    subject = SubjectFolders(tmp_path / "caps")
    write_text(subject.config / "compress.json", PLAIN.model_dump_json())
    cameras = (look_at_origin("cam0", 0, 5, 48),)  # held out: nothing that a camera decides
    scene = Scene("caps", cameras, ("holdout",), ("a", "b"), np.arange(2) / 25, 25.0, FROM_CAPTURE, (), subject.scene)
    write_scene(scene, subject.scene)
    subject.samples.mkdir()
    np.savez(subject.samples / "grids.npz", windows=np.array([WINDOW] * 3), centre=np.array(CENTRE))
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
    points = np.random.default_rng(0).normal(size=(5, 3))
    to_capture = Similarity.from_json(manifest.coordinates.to_capture.model_dump(mode="json"))
    back = to_capture.apply(FROM_CAPTURE.apply(points))
    np.testing.assert_allclose(back, points, atol=1e-12)


def rig(folders: SubjectFolders, **params: object) -> None:
    """Give the scene cameras, and `compress` other parameters."""
    cameras = tuple(look_at_origin(f"cam{i}", azimuth, 5, 48) for i, azimuth in enumerate((-30, 0, 10, 30)))
    scene = replace(read_scene(folders.scene), cameras=cameras, splits=("train", "holdout", "train", "train"))
    write_scene(scene, folders.scene)
    image = np.zeros((48, 48, 3), np.uint8)
    write_frames(folders.scene / "frames.arrow", image.shape, [(1, 0, image), (1, 1, image), (0, 0, image)])
    section = CompressParams.model_validate(merged(PLAIN.model_dump(), params))
    write_text(folders.config / "compress.json", section.model_dump_json())


def test_quality_by_target(folders: SubjectFolders) -> None:
    sizes, qualities = [], []
    for target in (30.0, LEAST_QUALITY):
        rig(folders, video={"target_psnr": target, "codec": ["h264", "vp9"], "preset": "veryfast"})
        compress(folders)
        assert validate_asset(folders.asset) == []
        level = read_asset(folders.asset).manifest.full
        qualities.append(level.quality.psnr_to_model - target)
        sizes.append([video.bytes for video in level.texture.videos])
    assert all(0 <= over < 1.5 for over in qualities), qualities
    assert all(coarse < fine for coarse, fine in zip(*sizes, strict=True))


def test_textures_too_large_for_a_video_are_refused_before_anything_is_encoded(
    folders: SubjectFolders, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig(folders, video={"target_psnr": 38.0})
    monkeypatch.setattr("facefolds_core.asset.packing.MAX_PIXELS", 10_000)
    monkeypatch.setattr("facefolds_core.asset.parts.encode_video", lambda *_: pytest.fail("encoded"))
    with pytest.raises(UserError, match="do not fit") as caught:
        compress(folders)
    assert "texture.resolution" in str(caught.value.remedy)
    assert not folders.asset.exists()


def test_a_failure_on_the_way_leaves_the_old_asset(folders: SubjectFolders, monkeypatch: pytest.MonkeyPatch) -> None:
    write_text(folders.asset / "manifest.json", "old")
    encode = Mock(side_effect=UserError("the disk is full"))
    monkeypatch.setattr("facefolds_core.asset.parts.encode_video", encode)
    with pytest.raises(UserError, match="full"):
        compress(folders)
    assert encode.called
    assert [(path.name, path.read_text()) for path in folders.asset.iterdir()] == [("manifest.json", "old")]


def test_mesh_error_in_pixels(folders: SubjectFolders) -> None:
    rig(folders, mesh={"max_error_pixels": 0.05, "compression_level": 7})
    compress(folders)
    asset = read_asset(folders.asset)
    cameras = [camera for camera in read_scene(folders.scene).cameras if camera.name != "cam1"]
    for crop, layer in zip(cap_crops(3, 2, 64), asset.layers, strict=True):
        for camera in cameras:
            ours, theirs = (camera.project(mesh.vertices.astype(float))[0] for mesh in (crop.mesh, layer))
            assert np.linalg.norm(ours[:, None] - theirs[None], axis=-1).min(1).max() <= 0.05
    exact = sum(len(encode_mesh(crop.mesh, PLAIN.mesh)[0]) for crop in cap_crops(3, 2, 64))
    assert sum(layer.bytes for layer in asset.manifest.full.layers) < exact / 2


def test_levels_of_detail(folders: SubjectFolders) -> None:
    levels = [
        {"name": "small", "mesh_resolution": 5, "texture_resolution": 16, "crf": 34, "max_error_pixels": 0.5},
        {"name": "medium", "mesh_resolution": 8, "texture_resolution": 32, "crf": 26},
    ]
    rig(folders, levels=levels)
    for side in (5, 8):
        write_meshes(folders.meshes / f"level_{side}.npz", [cap_mesh(radius_of(layer), side) for layer in range(3)])
    compress(folders)
    assert validate_asset(folders.asset) == []
    asset = read_asset(folders.asset)
    entries = asset.manifest.levels
    assert [entry.name for entry in entries] == ["small", "medium", "full"]
    assert all(a.bytes < b.bytes for a, b in pairwise(entries))
    qualities = [entry.quality.psnr_to_model for entry in entries]
    assert 15 < qualities[0] < qualities[1] < qualities[2]
    for entry, level, side in zip(entries, asset.levels, (5, 8, 12), strict=True):
        assert max(layer.vertices for layer in entry.layers) <= side**2
        assert len(list(level.frames())) == 2


def test_poster_photos_and_sound(folders: SubjectFolders) -> None:
    rig(folders, photos=3)
    save_wav(folders.scene / "audio.wav", np.zeros(1000), 16_000)
    compress(folders)
    assert validate_asset(folders.asset) == []
    manifest, scene = read_asset(folders.asset).manifest, read_scene(folders.scene)
    assert (manifest.audio.file, manifest.audio.mime) == ("audio.m4a", 'audio/mp4; codecs="mp4a.40.2"')
    assert max(manifest.poster.width, manifest.poster.height) == 48
    assert manifest.poster.K is not None and manifest.poster.background == BACKGROUND
    assert [(photo.camera, photo.frame) for photo in manifest.photos] == [("cam1", 0), ("cam1", 1)]
    np.testing.assert_array_equal(manifest.photos[0].w2c, scene.cameras[1].w2c)
    np.testing.assert_array_equal(manifest.photos[0].K, scene.cameras[1].K)
    train, unseen = ([scene.cameras[i] for i in scene.indices(split)] for split in ("train", "holdout"))
    assert manifest.view.measured is not None
    assert manifest.view.model_copy(update={"good": None}) == filmed_view(train, unseen)
    assert manifest.view.good.azimuth[0] < 0 < manifest.view.good.azimuth[1]


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
    np.savez(folders.samples / "grids.npz", windows=np.array([WINDOW] * 4), centre=np.array(CENTRE))
    with pytest.raises(UserError, match=r"do not belong together[^$]*grids\.npz"):
        compress(folders)
