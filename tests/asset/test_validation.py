"""The validator finds each kind of damage, and says so on the command line."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.asset.manifest import Manifest
from facefolds_core.asset.manifest_file import write_manifest
from facefolds_core.asset.validation import validate_asset
from facefolds_core.errors import UserError
from facefolds_core.files.writing import file_sha256
from tests.assets import cap_mesh, make_asset

FILES = ["manifest.json", "full_meshes.bin", "full.mp4"]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound") / "asset"
    make_asset(folder, layers=2, frames=3)
    return folder


@pytest.fixture
def asset(sound: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    return Path(shutil.copytree(sound, tmp_path / "asset"))


def assert_found(folder: Path, file: str, word: str = "") -> None:
    """The validator names the file (and says the word), and the reader refuses it."""
    problems = validate_asset(folder)
    assert any(problem.startswith(f"{file}:") and word in problem for problem in problems), problems
    with pytest.raises(UserError):
        list(read_asset(folder).frames())


def edit(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change the manifest's content; its own checksum is made anew."""
    value = json.loads((folder / "manifest.json").read_text())
    change(value)
    write_manifest(Manifest.model_validate_json(json.dumps(value)), folder / "manifest.json")


def video(value: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = value["levels"][0]["texture"]["videos"][0]
    return found


def add_up(value: dict[str, Any]) -> None:
    """Correct the level's total after a change of a file's size."""
    level = value["levels"][0]
    level["bytes"] = sum(entry["bytes"] for entry in [*level["meshes"], *level["texture"]["videos"]])


def replace_mesh(folder: Path, data: bytes, vertices: int, triangles: int) -> None:
    """Of layer 1, the last in the level's file."""
    path, digest = folder / "full_meshes.bin", hashlib.sha256(data).hexdigest()
    entry = {"bytes": len(data), "sha256": digest, "vertices": vertices, "triangles": triangles}

    def change(value: dict[str, Any]) -> None:
        level = value["levels"][0]
        level["layers"][1].update(entry)
        path.write_bytes(path.read_bytes()[: level["layers"][1]["offset"]] + data)
        level["meshes"][0].update(bytes=path.stat().st_size, sha256=file_sha256(path))
        add_up(value)

    edit(folder, change)


def draco(vertices: np.ndarray, faces: np.ndarray, st: np.ndarray | None) -> bytes:
    """As the writer encodes, but without its checks."""
    coordinates = None if st is None else st.astype(np.float64)
    return bytes(
        DracoPy.encode(
            vertices,
            faces=faces.astype(np.uint32),
            quantization_bits=0,
            compression_level=0,
            tex_coord=coordinates,
            preserve_order=True,
        )
    )


def test_sound(asset: Path) -> None:
    assert validate_asset(asset) == []


@pytest.mark.parametrize("file", FILES)
def test_missing_file(asset: Path, file: str) -> None:
    (asset / file).unlink()
    assert_found(asset, file)


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("keep", [0.0, 0.1, 0.5, 0.999])
def test_truncated_file(asset: Path, file: str, keep: float) -> None:
    data = (asset / file).read_bytes()
    (asset / file).write_bytes(data[: int(keep * len(data))])
    assert_found(asset, file)


@pytest.mark.parametrize("file", FILES)
def test_flipped_bits(asset: Path, file: str) -> None:
    data = (asset / file).read_bytes()
    rng = np.random.default_rng(0)
    places = [0, len(data) // 2, len(data) - 2, *rng.integers(0, len(data), 12)]
    for place in places:
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(rng.integers(8))
        (asset / file).write_bytes(flipped)
        assert validate_asset(asset), place
        with pytest.raises(UserError):
            read_asset(asset)


@pytest.mark.parametrize("key", ["vertices", "triangles"])
def test_wrong_mesh_counts(asset: Path, key: str) -> None:
    edit(asset, lambda value: value["levels"][0]["layers"][1].update({key: value["levels"][0]["layers"][1][key] + 1}))
    assert_found(asset, "full_meshes.bin", key)


@pytest.mark.parametrize("frames", [2, 4])
def test_wrong_number_of_frames(asset: Path, frames: int) -> None:
    edit(asset, lambda value: value["levels"][0]["texture"].update(frames=frames))
    assert_found(asset, "full.mp4", "3 frames")


def test_wrong_rate(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0]["texture"].update(frame_rate=[25, 1]))
    assert any("frames a second" in problem for problem in validate_asset(asset))


def test_wrong_video_size(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0]["texture"].update(width=value["levels"][0]["texture"]["width"] + 16))
    assert_found(asset, "full.mp4", "width and height")


def test_rect_outside(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0]["layers"][1].update(texture_rect=[130, 4, 64, 64]))
    assert_found(asset, "manifest.json", "not inside")


def test_rects_overlap(asset: Path) -> None:
    edit(
        asset,
        lambda value: value["levels"][0]["layers"][1].update(
            texture_rect=value["levels"][0]["layers"][0]["texture_rect"]
        ),
    )
    assert_found(asset, "manifest.json", "overlap")


def test_a_mesh_outside_its_file(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0]["layers"][1].update(offset=10**6))
    assert_found(asset, "manifest.json", "not inside a file")


def test_a_mesh_that_begins_elsewhere_in_its_file(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0]["layers"][1].update(offset=1))
    assert_found(asset, "full_meshes.bin", "layer 1: the SHA-256")


@pytest.mark.parametrize("keyframes", [[0, 3], [1], [0, 2, 1]])
def test_key_frames_that_are_none(asset: Path, keyframes: list[int]) -> None:
    edit(asset, lambda value: value["levels"][0]["texture"].update(keyframes=keyframes))
    assert_found(asset, "manifest.json", "keyframes")


def test_wrong_total(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0].update(bytes=value["levels"][0]["bytes"] + 1))
    assert_found(asset, "manifest.json", "those of its files")


def test_two_levels_of_one_name(asset: Path) -> None:
    edit(asset, lambda value: value.update(levels=value["levels"] * 2))
    assert_found(asset, "manifest.json", "one name")


def test_wrong_mime_type(asset: Path) -> None:
    edit(asset, lambda value: video(value).update(mime='video/mp4; codecs="avc1.42001e"'))
    assert any("MIME type" in problem for problem in validate_asset(asset))


def test_empty_window(asset: Path) -> None:
    edit(asset, lambda value: value["levels"][0]["layers"][0].update(uv_window=[0.5, 0.5, -1.0, 1.0]))
    assert_found(asset, "manifest.json", "uv_window")


def test_rotation_that_is_none(asset: Path) -> None:
    edit(asset, lambda value: value["coordinates"]["to_capture"].update(rotation=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]))
    assert_found(asset, "manifest.json", "rotation")


def test_texture_coordinates_outside(asset: Path) -> None:
    mesh = cap_mesh(0.3, 4)
    replace_mesh(asset, draco(mesh.vertices, mesh.faces, mesh.st * 1.5), 16, 18)
    assert_found(asset, "full_meshes.bin", "outside [0, 1]")


def test_no_texture_coordinates(asset: Path) -> None:
    mesh = cap_mesh(0.3, 4)
    replace_mesh(asset, draco(mesh.vertices, mesh.faces, None), 16, 18)
    assert_found(asset, "full_meshes.bin", "no texture coordinates")


def test_vertices_not_finite(asset: Path) -> None:
    mesh = cap_mesh(0.3, 4)
    vertices = mesh.vertices.copy()
    vertices[5, 2] = np.nan
    replace_mesh(asset, draco(vertices, mesh.faces, mesh.st), 16, 18)
    assert_found(asset, "full_meshes.bin", "not finite")


def test_degenerate_face(asset: Path) -> None:
    mesh = cap_mesh(0.3, 4)
    vertices = mesh.vertices.copy()
    vertices[1] = vertices[0]
    replace_mesh(asset, draco(vertices, mesh.faces, mesh.st), 16, 18)
    assert any("without area" in problem for problem in validate_asset(asset))


def test_not_a_mesh(asset: Path) -> None:
    replace_mesh(asset, b"something else" * 9, 16, 18)
    assert_found(asset, "full_meshes.bin", "not a Draco mesh")


def test_file_that_the_manifest_does_not_name(asset: Path) -> None:
    (asset / "full_02.bin").write_bytes(b"")
    assert validate_asset(asset) == ["full_02.bin: not named in the manifest"]


def test_damaged_video_with_a_matching_checksum_is_no_traceback(asset: Path) -> None:
    path, rng = asset / "full.mp4", np.random.default_rng(0)
    data, found = path.read_bytes(), 0
    for place in rng.integers(0, 1200, 60):  # the container's header: the most that can be wrong
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        edit(asset, lambda value: video(value).update(sha256=file_sha256(path)))
        found += bool(validate_asset(asset))
    assert found > 0


def run_command(folder: Path) -> subprocess.CompletedProcess[str]:
    root = Path(__file__).parents[2]
    return subprocess.run(
        [sys.executable, "-m", "facefolds_core", "validate", str(folder)],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )


def test_command_on_a_sound_asset(asset: Path) -> None:
    done = run_command(asset)
    assert done.returncode == 0 and len(done.stdout.splitlines()) == 1 and "sound" in done.stdout


def test_command_on_a_damaged_asset(asset: Path) -> None:
    (asset / "manifest.json").write_text("not JSON")
    done = run_command(asset)
    assert done.returncode == 1 and "garbled JSON" in done.stderr and "Traceback" not in done.stderr
