"""Damaged files of the extension: each refused in words that name the place, or harmless."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from facefolds_core.asset.glb import container
from facefolds_core.asset.gltf.checking import check_glb
from facefolds_core.asset.gltf.extension import NAME, TEXTURE_VIDEO
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.cli import app
from tests.assets import OVER_TORSO
from tests.gltf_files import opened
from tests.hostile.damage import MUTATIONS
from tests.hostile.structured import damage_values
from tests.viewer.fixtures import moving_asset

Document = dict[str, Any]
DAMAGED = 1000
"""Files, which take seconds."""
PLACE = re.compile(r"^(/.*|byte \d+): .+")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    asset = moving_asset(tmp_path_factory.mktemp("whole") / "asset", OVER_TORSO, layers=2, resolution=32)
    write_layered(asset.folder.with_suffix(".glb"), asset.full, "caps")
    return asset.folder.with_suffix(".glb")


def test_the_command_says_whether_one_is_sound(whole: Path, tmp_path: Path) -> None:
    assert check_glb(whole) == []
    (tmp_path / "a.glb").write_bytes(whole.read_bytes()[:-4])
    for path, status, words in ((whole, 0, "sound"), (tmp_path / "a.glb", 1, "byte 8: the header says")):
        done = CliRunner().invoke(app, ["validate", str(path)])
        assert done.exit_code == status and words in done.output


def layered(document: Document) -> Any:
    return document["nodes"][0]["extensions"][NAME]


HERE = f"/nodes/0/extensions/{NAME}"
MISTAKES: dict[str, tuple[Callable[[Document], Any], str]] = {
    "no layers": (lambda d: layered(d).pop("mesh"), f"{HERE}/mesh: Field required"),
    "unknown key": (lambda d: layered(d).update(meshs=1), f"{HERE}/meshs: "),
    "no such mesh": (lambda d: layered(d).update(mesh=7), f"{HERE}/mesh: there is no meshes[7]"),
    "the still": (lambda d: layered(d).update(mesh=0), "/nodes/0/mesh: it would show the layers"),
    "overlap": (
        lambda d: layered(d)["rectangles"].__setitem__(1, layered(d)["rectangles"][0]),
        f"{HERE}: the rectangles of layers 0 and 1 overlap",
    ),
    "other pictures": (lambda d: layered(d).update(width=64), f"{HERE}: colorRectangle"),
    "fewer frames": (lambda d: layered(d).update(frames=2), f"/extensions/{TEXTURE_VIDEO}/videos/0: 3 pictures, 2"),
    "another rate": (lambda d: layered(d).update(frameRate=[25, 1]), "/animations/0/samplers/0/input: not the times"),
    "no such still": (lambda d: layered(d).update(stillFrame=3), f"{HERE}/stillFrame: frame 3 of"),
    "no video": (lambda d: d["textures"][1].pop("extensions"), f"/textures/1/extensions/{TEXTURE_VIDEO}: "),
    "not used": (lambda d: d["extensionsUsed"].remove(NAME), f"/extensionsUsed: {NAME} is missing"),
    "no still": (lambda d: d["nodes"][0].pop("mesh"), "/nodes/0: no mesh for viewers"),
    "uneven": (lambda d: d["nodes"][0].update(scale=[1, 1, 2]), "/nodes/0/scale: uneven"),
    "no extension": (lambda d: d["nodes"][0].pop("extensions"), f"/nodes: none has {NAME}"),
    "lines": (lambda d: d["meshes"][1]["primitives"][1].update(mode=1), "/meshes/1/primitives/1/mode: 1, triangles"),
    "cut view": (lambda d: d["bufferViews"][-1].update(byteLength=10**8), "/bufferViews/{last}: it ends at byte"),
    "other node": (
        lambda d: d["animations"][0]["channels"][1]["target"].update(node=1),
        "/animations/0/channels/1/target: not this node's",
    ),
    "another checksum": (
        lambda d: layered(d)["checksums"][2].update(sha256=64 * "0"),
        "/bufferViews/2: damaged: another SHA-256 than",
    ),
    "no such part": (
        lambda d: layered(d)["checksums"][2].update(bufferView=10**4),
        f"{HERE}/checksums/2/bufferView: there is no bufferViews[10000]",
    ),
    "a slanting torso": (lambda d: layered(d)["torso"].update(normal=[1, 1, 0]), f"{HERE}/torso/normal: not of unit"),
    "a torso of a scaled node": (lambda d: d["nodes"][0].update(scale=[2, 2, 2]), "/nodes/0/scale: none is taken with"),
    "nothing to stay over": (lambda d: layered(d).pop("animation"), f"{HERE}/torso: there is no animation"),
    "maps beyond": (
        lambda d: layered(d)["reflection"].update(glossRectangle=[0, 0, 4000, 1]),
        f"{HERE}/reflection/glossRectangle: ",
    ),
}


@pytest.mark.parametrize(("change", "expected"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_with_its_place(
    whole: Path, tmp_path: Path, change: Callable[[Document], Any], expected: str
) -> None:
    document, binary = opened(whole)
    change(document)
    (tmp_path / "a.glb").write_bytes(container(document, binary))
    problems = check_glb(tmp_path / "a.glb")
    wanted = expected.replace("{last}", str(len(document["bufferViews"]) - 1))
    assert any(problem.startswith(wanted) for problem in problems), problems


def damaged(whole: Path, random: np.random.Generator) -> bytes:
    """The file with its bytes damaged, or values of its JSON replaced, taken out or doubled."""
    kind = int(random.integers(2 * len(MUTATIONS)))
    if kind < len(MUTATIONS):
        return MUTATIONS[kind](whole.read_bytes(), random)
    document, binary = opened(whole)
    for _ in range(int(random.integers(1, 4))):
        damage_values(document, random)
    text = json.dumps(document).encode()  # by hand: `container` refuses what is no number
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_damaged_files_are_refused_in_words_or_harmless(whole: Path, tmp_path: Path) -> None:
    file, refused = tmp_path / "a.glb", 0
    for seed in range(DAMAGED):
        file.write_bytes(damaged(whole, np.random.default_rng(seed)))
        problems = check_glb(file)
        refused += bool(problems)
        wordless = [problem for problem in problems if not PLACE.match(problem) or "Traceback" in problem]
        assert wordless == [], seed
    assert refused > 0.6 * DAMAGED
