"""The validator names what is wrong, by damage or behind right checksums, the reader refuses it; and the command."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.asset.validation import validate_asset
from facefolds_core.cli import app
from facefolds_core.errors import UserError
from tests.assets import cap_mesh
from tests.hostile.damage import flip_bits
from tests.hostile.fuzz_assets import edit, put, swap
from tests.viewer.fixtures import change_manifest, file_entry

READ = ("manifest.json", "full_meshes.bin", "full.mp4")
"""Of these the reader wants to know at once whether they are whole."""


def assert_found(folder: Path, file: str, word: str = "") -> None:
    """The validator names the file (and says the word), and the reader refuses it."""
    problems = validate_asset(folder)
    assert any(problem.startswith(f"{file}:") and word in problem for problem in problems), problems
    with pytest.raises(UserError):
        list(read_asset(folder).frames())


def test_damage_of_any_file_is_named(rich: Path, tmp_path: Path) -> None:
    assert validate_asset(rich) == []
    for path in sorted(rich.iterdir()):
        folder = Path(shutil.copytree(rich, tmp_path / path.name))
        data = path.read_bytes()
        flipped = flip_bits(data, np.random.default_rng(len(path.name)))
        for what, damaged in enumerate((data[: len(data) // 2], data[:-1], flipped, None)):  # None: missing
            (folder / path.name).unlink()
            if damaged is not None:
                (folder / path.name).write_bytes(damaged)
            assert any(problem.startswith(f"{path.name}:") for problem in validate_asset(folder)), (path.name, what)
            if path.name in READ:
                with pytest.raises(UserError):
                    read_asset(folder)


def textures(**values: object) -> Callable[[Any], object]:
    """Values of the textures of all levels."""
    return lambda manifest: [level["texture"].update(values) for level in manifest["levels"]]


FULL = ("levels", 1)
LAYER, TEXTURE = (*FULL, "layers", 2), (*FULL, "texture")
ROTATION = ("coordinates", "to_capture", "rotation")
MIRRORED = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]
WRONG: list[tuple[Callable[[Any], object], str, str]] = [
    (put(*LAYER, "vertices", to=7), "full_meshes.bin", "vertices"),
    (put(*LAYER, "triangles", to=7), "full_meshes.bin", "triangles"),
    (put(*LAYER, "offset", to=1), "full_meshes.bin", "layer 2: the SHA-256"),
    (put(*LAYER, "offset", to=10**6), "manifest.json", "not inside a file"),
    (put(*LAYER, "texture_rect", to=[10**4, 4, 64, 64]), "manifest.json", "not inside"),
    (put(*LAYER, "texture_rect", to=[5, 5, 64, 64]), "manifest.json", "overlap"),
    (put(*LAYER, "uv_window", to=[0.5, 0.5, -1.0, 1.0]), "manifest.json", "uv_window"),
    (textures(frames=5), "full.mp4", "6 frames"),
    (textures(frames=7), "full.mp4", "6 frames"),
    (put(*TEXTURE, "width", to=1024), "full.mp4", "width and height"),
    (put(*TEXTURE, "keyframes", to=[0, 6]), "manifest.json", "keyframes"),
    (put(*TEXTURE, "keyframes", to=[1]), "manifest.json", "keyframes"),
    (put(*TEXTURE, "keyframes", to=[0, 2, 1]), "manifest.json", "keyframes"),
    (put(*FULL, "bytes", to=1), "manifest.json", "those of its files"),
    (lambda manifest: manifest.update(levels=manifest["levels"] * 2), "manifest.json", "one name"),
    (put(*ROTATION, to=MIRRORED), "manifest.json", "rotation"),
]


@pytest.mark.parametrize(("change", "file", "word"), WRONG)
def test_wrong_values(rich_copy: Path, change: Callable[[Any], object], file: str, word: str) -> None:
    edit(rich_copy, change)
    assert_found(rich_copy, file, word)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (textures(frame_rate=[25, 1]), "frames a second"),
        (put(*TEXTURE, "videos", 0, "mime", to='video/mp4; codecs="avc1.42001e"'), "MIME type"),
        (lambda manifest: manifest["levels"][1]["layers"].reverse(), "outermost in"),
        (lambda manifest: swap(manifest["levels"][1]["texture"], "colour_rect", "alpha_rect"), "alpha_rect"),
    ],
)
def test_what_is_wrong_but_can_be_read(rich_copy: Path, change: Callable[[Any], object], word: str) -> None:
    edit(rich_copy, change)
    assert any(word in problem for problem in validate_asset(rich_copy))


def replace_mesh(folder: Path, data: bytes, vertices: int, triangles: int) -> None:
    """Of the full level's last layer."""
    path, entry = folder / "full_meshes.bin", {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}

    def change(value: dict[str, Any]) -> None:
        level = value["levels"][1]
        level["layers"][2].update(entry, vertices=vertices, triangles=triangles)
        path.write_bytes(path.read_bytes()[: level["layers"][2]["offset"]] + data)
        level["meshes"][0].update(file_entry(path))

    change_manifest(folder, change)


def draco(vertices: np.ndarray, faces: np.ndarray, st: np.ndarray | None) -> bytes:
    """As the writer encodes, but without its checks."""
    coordinates = None if st is None else st.astype(np.float64)
    options = {"quantization_bits": 0, "compression_level": 0, "tex_coord": coordinates, "preserve_order": True}
    return bytes(DracoPy.encode(vertices, faces=faces.astype(np.uint32), **options))


def test_meshes_that_are_none(rich_copy: Path) -> None:
    mesh = cap_mesh(0.3, 4)
    holed, thin = mesh.vertices.copy(), mesh.vertices.copy()
    holed[5, 2], thin[1] = np.nan, thin[0]
    for data, word in (
        (draco(mesh.vertices, mesh.faces, mesh.st * 1.5), "outside [0, 1]"),
        (draco(mesh.vertices, mesh.faces, None), "no texture coordinates"),
        (draco(holed, mesh.faces, mesh.st), "not finite"),
        (b"something else" * 9, "not a Draco mesh"),
    ):
        replace_mesh(rich_copy, data, 16, 18)
        assert_found(rich_copy, "full_meshes.bin", word)
    replace_mesh(rich_copy, draco(thin, mesh.faces, mesh.st), 16, 18)
    assert any("without area" in problem for problem in validate_asset(rich_copy))


def test_file_that_the_manifest_does_not_name(rich_copy: Path) -> None:
    (rich_copy / "full_02.bin").write_bytes(b"")
    assert validate_asset(rich_copy) == ["full_02.bin: not named in the manifest"]


def test_the_command(rich_copy: Path) -> None:
    done = CliRunner().invoke(app, ["validate", str(rich_copy)])
    assert done.exit_code == 0 and len(done.stdout.splitlines()) == 1 and "sound" in done.stdout
    (rich_copy / "manifest.json").write_text("not JSON")
    done = CliRunner().invoke(app, ["validate", str(rich_copy)])
    assert done.exit_code == 1 and "garbled JSON" in done.stderr
