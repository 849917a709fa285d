"""Assets that no writer makes: absurd numbers, wrong order, special files, files that change after the check."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from facefolds_core.asset import read_asset
from facefolds_core.asset.checks import mesh_problems
from facefolds_core.asset.draco import DracoError, decode_mesh
from facefolds_core.asset.manifest_file import parse_manifest
from facefolds_core.asset.reader import read_level
from facefolds_core.asset.validation import lies_within, validate_asset
from facefolds_core.errors import UserError
from facefolds_core.geometry.meshes import TexturedMesh
from tests.asset.filmed import filmed, packaged
from tests.asset.test_validation import textures
from tests.assets import CENTRE, cap_mesh
from tests.hostile.fuzz_assets import edit, put
from tests.hostile.structured import ODD
from tests.viewer.fixtures import file_entry

Value = dict[str, Any]


def refused(folder: Path, word: str) -> None:
    problems = validate_asset(folder)
    assert any(word in problem for problem in problems), problems
    with pytest.raises(UserError):
        read_asset(folder)


LAYER, TEXTURE, PLACE = ("levels", 0, "layers", 0), ("levels", 0, "texture"), ("coordinates", "to_capture")
NO_NUMBERS = ("6", True, 6.5, [6], None, [6, 0], [6, 1e0])
NAMES = ("../x", "/etc/passwd", "a\\b", "a/b", "file:x", "http://x/", "..", ".", "", ".x", "a\n")
ABSURD: dict[str, tuple[Callable[[Value], object], str]] = {
    "scale": (put(*PLACE, "scale", to=1e300), "scale"),
    "rotation": (put(*PLACE, "rotation", to=[[1e300, 0, 0], [0, 1e300, 0], [0, 0, 1e300]]), "rotation"),
    "translation": (put(*PLACE, "translation", to=[1e300, 0, 0]), "translation"),
    "centre": (put("coordinates", "sphere_centre", to=[0, 0, 1e300]), "sphere_centre"),
    "vertices": (put(*LAYER, "vertices", to=10**12), "too many"),
    "width": (put(*TEXTURE, "width", to=10**9), "pixels"),
    "poster": (put("poster", "height", to=10**9), "poster.png"),
    "poster's camera": (put("poster", "K", to=[[1.0, 0, 1], [0, 1, 1], [0, 0, 1]]), "come together"),
    "distance": (put("view", to={"azimuth": [0, 1], "elevation": [0, 1], "distance": [0, 1e300]}), "distances"),
    "bounds": (put("bounds", "max", to=[1e300, 1, 1]), "bounds"),
    "bounds' order": (put("bounds", "min", to=[9, 9, 9]), "bounds"),
    "extensions": (put("extensionsRequired", to=["X"]), "extension"),
    "deep extras": (put("extras", to=json.loads("[" * 900 + "]" * 900)), ""),
    "reflection": (put("levels", 1, "reflection", "width", to=10**9), "pixels"),
    "reflection's scale": (put("levels", 1, "reflection", "gloss_scale", to=1e300), "gloss_scale"),
    "name": (put(*LAYER, "mesh", to="a" * 5000), "mesh"),
    "subject": (put("subject", to="\x1b[31mred"), "text"),
    "focal length": (put("photos", 0, "K", to=[[1e300, 0, 1], [0, 1, 1], [0, 0, 1]]), "K is no camera's"),
    "camera": (put("photos", 0, "w2c", to=[[1, 0, 0, 1e300], [0, 1, 0, 0], [0, 0, 1, 0]]), "units away"),
    "mirrored camera": (put("photos", 0, "w2c", to=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0]]), "not a rotation"),
    "photo's frame": (put("photos", 0, "frame", to=99), "frame 99 of 6"),
    "ten thousand layers": (lambda value: value["levels"][0].update(layers=value["levels"][0]["layers"] * 5000), "256"),
    "levels' order": (lambda value: value["levels"].reverse(), "coarsest first"),
    "names that differ by case": (put("photos", 1, "file", to="PHOTO0.PNG"), "named twice"),
    "a fast video": (textures(frame_rate=[10**8, 1]), "frames"),
    "a slow video": (textures(frame_rate=[1, 10**8]), "frames"),
    "a long video": (textures(frames=10**9), "frames"),
    **{f"frames {x!r}": (put(*TEXTURE, "frames", to=x), "levels.0.texture.frames") for x in NO_NUMBERS},
    **{f"rate {x!r}": (put(*TEXTURE, "frame_rate", to=x), "levels.0.texture.frame_rate") for x in NO_NUMBERS},
    **{f"mesh {name!r}": (put(*LAYER, "mesh", to=name), "levels.0.layers.0.mesh") for name in NAMES},
}


@pytest.mark.parametrize(("change", "word"), ABSURD.values(), ids=ABSURD)
def test_what_no_writer_makes_is_refused_at_once(rich_copy: Path, change: Callable[[Value], object], word: str) -> None:
    edit(rich_copy, change)
    start = time.monotonic()
    refused(rich_copy, word)
    assert time.monotonic() - start < 5


def test_levels_in_the_wrong_order_are_not_written(tmp_path: Path) -> None:
    sides = {"fine": 32, "coarse": 16}
    levels = [{"name": k, "mesh_resolution": n, "texture_resolution": n, "crf": 30} for k, n in sides.items()]
    with pytest.raises(UserError, match="wrong order"):
        packaged(tmp_path / "asset", filmed(tmp_path / "scene"), {"levels": levels})


def test_nesting_of_touching_layers_is_not_judged() -> None:
    a, b = cap_mesh(0.3), cap_mesh(0.2)
    assert lies_within(b, a, CENTRE)
    assert not lies_within(a, b, CENTRE)
    assert not lies_within(a, a, CENTRE)


@pytest.mark.parametrize(("factor", "word"), [(0.0, "one point"), (1e30, "units from the origin"), (np.nan, "finite")])
def test_meshes_of_absurd_size(factor: float, word: str) -> None:
    mesh = cap_mesh(0.3, 4)
    problems = mesh_problems(TexturedMesh(np.float32(factor) * mesh.vertices, mesh.faces, mesh.st), 16, 18)
    assert len(problems) == 1 and word in problems[0]


def test_a_mesh_that_claims_more_than_there_is(rich_copy: Path) -> None:
    data = bytearray((rich_copy / "full_meshes.bin").read_bytes())
    place = 11 if data[8] == 0 else 12
    data[place : place + 2] = b"\xff\xff\xff\xff\x07"
    with pytest.raises(DracoError, match="claims 2147483647"):
        decode_mesh(bytes(data))


@pytest.mark.parametrize("name", ["manifest.json", "full.mp4", "full_meshes.bin", "poster.png"])
@pytest.mark.parametrize("kind", ["FIFO", "device", "folder", "loop"])
def test_what_is_no_file_is_not_opened(rich_copy: Path, name: str, kind: str) -> None:
    path = rich_copy / name
    path.unlink()
    ODD[kind](path)
    refused(rich_copy, name)


def test_a_link_that_leads_out(rich_copy: Path) -> None:
    shutil.move(rich_copy / "full.mp4", rich_copy.parent / "full.mp4")
    (rich_copy / "full.mp4").symlink_to("../full.mp4")
    assert validate_asset(rich_copy) == ["full.mp4: a link that leads out of the folder"]


def test_a_manifest_of_a_terabyte(rich_copy: Path) -> None:
    os.truncate(rich_copy / "manifest.json", 1 << 40)
    refused(rich_copy, "bytes, a manifest at most")


def test_strays_are_counted_not_listed_without_end(rich_copy: Path) -> None:
    for index in range(300):
        (rich_copy / f"stray{index}").touch()
    problems = validate_asset(rich_copy)
    assert len(problems) == 21 and "280 more" in problems[-1]


def test_a_picture_larger_than_said_is_not_decoded(rich_copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Image.new("RGB", (4000, 4000)).save(rich_copy / "poster.png")
    edit(rich_copy, lambda value: value["poster"].update(file_entry(rich_copy / "poster.png")))
    decoded = []
    monkeypatch.setattr("PIL.ImageFile.ImageFile.load", lambda self: decoded.append(self.size))
    problems = [problem for problem in validate_asset(rich_copy) if problem.startswith("poster.png")]
    assert problems == ["poster.png: 4000 x 4000 pixels, the manifest says 90 x 60"]
    assert (64, 64) in decoded and (4000, 4000) not in decoded


def test_a_picture_beyond_pillows_limit_is_no_traceback(rich_copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    assert any("poster.png: not a picture" in problem for problem in validate_asset(rich_copy))


def test_a_sound_that_is_none(rich_copy: Path) -> None:
    (rich_copy / "audio.wav").write_bytes(b"#EXTM3U\n/etc/passwd\n")
    edit(rich_copy, lambda value: value["audio"].update(file_entry(rich_copy / "audio.wav")))
    assert [problem[:22] for problem in validate_asset(rich_copy)] == ["audio.wav: not a sound"]


@pytest.mark.parametrize("name", ["full.mp4", "full_reflection.png"])
def test_what_changes_after_the_check_is_not_decoded(rich_copy: Path, name: str) -> None:
    found = read_asset(rich_copy)
    found.frame(0), found.reflection()
    data = bytearray((rich_copy / name).read_bytes())
    data[len(data) // 2] ^= 1
    (rich_copy / name).write_bytes(data)
    os.utime(rich_copy / name, (1, 1))
    with pytest.raises(UserError, match="damaged asset"):
        found.frame(0), found.reflection()


def test_a_level_is_not_decoded_from_other_meshes(rich_copy: Path) -> None:
    level = parse_manifest(rich_copy / "manifest.json").full
    path, first, second = rich_copy / level.meshes[0].file, level.layers[0], level.layers[1]
    data = path.read_bytes()
    path.write_bytes(data[second.offset : second.offset + first.bytes] + data[first.bytes :])
    with pytest.raises(UserError, match="damaged asset"):
        read_level(rich_copy, level)
