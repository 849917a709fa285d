"""The validator finds what is wrong behind the checksums (damage: test_damage), and says so on the command line."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.asset.manifest import Manifest
from facefolds_core.asset.manifest_file import write_manifest
from facefolds_core.asset.validation import validate_asset
from facefolds_core.cli import app
from facefolds_core.errors import UserError
from facefolds_core.files.writing import file_sha256
from tests.assets import cap_mesh, make_asset


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


def level(value: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = value["levels"][0]
    return found


def layer(value: dict[str, Any], index: int = 1) -> dict[str, Any]:
    found: dict[str, Any] = level(value)["layers"][index]
    return found


def texture(value: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = level(value)["texture"]
    return found


MIRRORED = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]
WRONG: list[tuple[Callable[[dict[str, Any]], None], str, str]] = [
    (lambda value: layer(value).update(vertices=layer(value)["vertices"] + 1), "full_meshes.bin", "vertices"),
    (lambda value: layer(value).update(triangles=layer(value)["triangles"] + 1), "full_meshes.bin", "triangles"),
    (lambda value: layer(value).update(offset=1), "full_meshes.bin", "layer 1: the SHA-256"),
    (lambda value: layer(value).update(offset=10**6), "manifest.json", "not inside a file"),
    (lambda value: layer(value).update(texture_rect=[130, 4, 64, 64]), "manifest.json", "not inside"),
    (lambda value: layer(value).update(texture_rect=layer(value, 0)["texture_rect"]), "manifest.json", "overlap"),
    (lambda value: layer(value).update(uv_window=[0.5, 0.5, -1.0, 1.0]), "manifest.json", "uv_window"),
    (lambda value: texture(value).update(frames=2), "full.mp4", "3 frames"),
    (lambda value: texture(value).update(frames=4), "full.mp4", "3 frames"),
    (lambda value: texture(value).update(width=texture(value)["width"] + 16), "full.mp4", "width and height"),
    (lambda value: texture(value).update(keyframes=[0, 3]), "manifest.json", "keyframes"),
    (lambda value: texture(value).update(keyframes=[1]), "manifest.json", "keyframes"),
    (lambda value: texture(value).update(keyframes=[0, 2, 1]), "manifest.json", "keyframes"),
    (lambda value: level(value).update(bytes=level(value)["bytes"] + 1), "manifest.json", "those of its files"),
    (lambda value: value.update(levels=value["levels"] * 2), "manifest.json", "one name"),
    (lambda value: value["coordinates"]["to_capture"].update(rotation=MIRRORED), "manifest.json", "rotation"),
]


@pytest.mark.parametrize(("change", "file", "word"), WRONG)
def test_wrong_values(asset: Path, change: Callable[[dict[str, Any]], None], file: str, word: str) -> None:
    edit(asset, change)
    assert_found(asset, file, word)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda value: texture(value).update(frame_rate=[25, 1]), "frames a second"),
        (lambda value: video(value).update(mime='video/mp4; codecs="avc1.42001e"'), "MIME type"),
    ],
)
def test_what_is_wrong_but_can_be_read(asset: Path, change: Callable[[dict[str, Any]], None], word: str) -> None:
    edit(asset, change)
    assert any(word in problem for problem in validate_asset(asset))


def test_meshes_that_are_none(asset: Path) -> None:
    mesh = cap_mesh(0.3, 4)
    holed, thin = mesh.vertices.copy(), mesh.vertices.copy()
    holed[5, 2], thin[1] = np.nan, thin[0]
    for data, word in (
        (draco(mesh.vertices, mesh.faces, mesh.st * 1.5), "outside [0, 1]"),
        (draco(mesh.vertices, mesh.faces, None), "no texture coordinates"),
        (draco(holed, mesh.faces, mesh.st), "not finite"),
        (b"something else" * 9, "not a Draco mesh"),
    ):
        replace_mesh(asset, data, 16, 18)
        assert_found(asset, "full_meshes.bin", word)
    replace_mesh(asset, draco(thin, mesh.faces, mesh.st), 16, 18)
    assert any("without area" in problem for problem in validate_asset(asset))


def test_file_that_the_manifest_does_not_name(asset: Path) -> None:
    (asset / "full_02.bin").write_bytes(b"")
    assert validate_asset(asset) == ["full_02.bin: not named in the manifest"]


def test_the_command(asset: Path) -> None:
    done = CliRunner().invoke(app, ["validate", str(asset)])
    assert done.exit_code == 0 and len(done.stdout.splitlines()) == 1 and "sound" in done.stdout
    (asset / "manifest.json").write_text("not JSON")
    done = CliRunner().invoke(app, ["validate", str(asset)])
    assert done.exit_code == 1 and "garbled JSON" in done.stderr
