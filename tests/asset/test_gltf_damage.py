"""Damaged files of the extension: each refused in words that name the place, or harmless."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.asset.glb import container
from facefolds_core.asset.gltf.checking import check_glb
from facefolds_core.asset.gltf.extension import NAME, TEXTURE_VIDEO
from facefolds_core.asset.gltf.writing import write_layered
from facefolds_core.cli import app
from facefolds_core.geometry.track import Track
from tests.assets import SOURCE, make_asset
from tests.geometry.test_track import SHIFTS, TURNS
from tests.gltf_files import opened
from tests.viewer.fixtures import add_reflection

Document = dict[str, Any]
PLACE = re.compile(r"^(/.*|byte \d+): .+")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "asset"
    make_asset(folder, layers=2, frames=3, resolution=32, source=replace(SOURCE, track=Track.of(TURNS, SHIFTS)))
    add_reflection(folder)
    write_layered(folder.with_suffix(".glb"), read_asset(folder).full, "caps")
    return folder.with_suffix(".glb")


def test_a_whole_one_is_sound(whole: Path) -> None:
    assert check_glb(whole) == []
    done = CliRunner().invoke(app, ["validate", str(whole)])
    assert done.exit_code == 0 and "sound" in done.output


def layered(document: Document) -> Document:
    found: Document = document["nodes"][0]["extensions"][NAME]
    return found


MISTAKES: dict[str, tuple[Callable[[Document], Any], str]] = {
    "no layers": (lambda d: layered(d).pop("mesh"), f"/nodes/0/extensions/{NAME}/mesh: Field required"),
    "unknown key": (lambda d: layered(d).update(meshs=1), f"/nodes/0/extensions/{NAME}/meshs: "),
    "no such mesh": (lambda d: layered(d).update(mesh=7), f"/nodes/0/extensions/{NAME}/mesh: there is no meshes[7]"),
    "the still": (lambda d: layered(d).update(mesh=0), "/nodes/0/mesh: it would show the layers"),
    "overlap": (
        lambda d: layered(d)["rectangles"].__setitem__(1, layered(d)["rectangles"][0]),
        f"/nodes/0/extensions/{NAME}: the rectangles of layers 0 and 1 overlap",
    ),
    "other pictures": (lambda d: layered(d).update(width=64), f"/nodes/0/extensions/{NAME}: colorRectangle"),
    "fewer frames": (lambda d: layered(d).update(frames=2), f"/extensions/{TEXTURE_VIDEO}/videos/0: 3 pictures, 2"),
    "another rate": (lambda d: layered(d).update(frameRate=[25, 1]), "/animations/0/samplers/0/input: not the times"),
    "no such still": (lambda d: layered(d).update(stillFrame=3), f"/nodes/0/extensions/{NAME}/stillFrame: frame 3 of"),
    "no video": (lambda d: d["textures"][1].pop("extensions"), f"/textures/1/extensions/{TEXTURE_VIDEO}: "),
    "not used": (lambda d: d["extensionsUsed"].remove(NAME), f"/extensionsUsed: {NAME} is missing"),
    "no still": (lambda d: d["nodes"][0].pop("mesh"), "/nodes/0: no mesh for viewers"),
    "uneven": (lambda d: d["nodes"][0].update(scale=[1, 1, 2]), "/nodes/0/scale: uneven"),
    "no extension": (lambda d: d["nodes"][0].pop("extensions"), f"/nodes: none has {NAME}"),
    "lines": (lambda d: d["meshes"][1]["primitives"][1].update(mode=1), "/meshes/1/primitives/1/mode: 1, triangles"),
    "cut view": (
        lambda d: d["bufferViews"][-1].update(byteLength=10**8),
        "/bufferViews/{last}: it ends at byte",
    ),
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
        f"/nodes/0/extensions/{NAME}/checksums/2/bufferView: there is no bufferViews[10000]",
    ),
    "maps beyond": (
        lambda d: layered(d)["reflection"].update(glossRectangle=[0, 0, 4000, 1]),
        f"/nodes/0/extensions/{NAME}/reflection/glossRectangle: ",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_named_with_its_place(whole: Path, tmp_path: Path, name: str) -> None:
    document, binary = opened(whole)
    change, expected = MISTAKES[name]
    change(document)
    (tmp_path / "a.glb").write_bytes(container(document, binary))
    problems = check_glb(tmp_path / "a.glb")
    wanted = expected.replace("{last}", str(len(document["bufferViews"]) - 1))
    assert any(problem.startswith(wanted) for problem in problems), problems


def test_the_command_says_what_is_wrong(whole: Path, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(whole.read_bytes()[:-4])
    done = CliRunner().invoke(app, ["validate", str(tmp_path / "a.glb")])
    assert done.exit_code == 1 and "byte 8: the header says" in done.output


def values_in(document: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where every value of a JSON document stands."""
    items = document.items() if isinstance(document, dict) else enumerate(document)
    found = []
    for key, value in items:
        found.append((*path, key))
        if isinstance(value, dict | list):
            found += values_in(value, (*path, key))
    return found


STRANGE = (None, True, -1, 0, 1, 3, 2**31, 10**30, 1.5, 1e300, "", "0", [], {}, [[]], [0, 0, 0, 0], {"a": {}})


def damaged(whole: Path, rng: np.random.Generator) -> bytes:
    """The file with flipped bits, cut, filled with noise, or with values of its JSON replaced, taken out or doubled."""
    data = bytearray(whole.read_bytes())
    kind = int(rng.integers(6))
    if kind == 0:
        return bytes(data[: int(rng.integers(len(data)))])
    if kind == 1:
        for place in rng.integers(len(data), size=int(rng.integers(1, 8))):
            data[place] ^= 1 << int(rng.integers(8))
        return bytes(data)
    if kind == 2:
        start = int(rng.integers(len(data)))
        stop = min(len(data), start + int(rng.integers(1, 200)))
        data[start:stop] = rng.bytes(stop - start)
        return bytes(data)
    document, binary = opened(whole)
    document = copy.deepcopy(document)
    for _ in range(int(rng.integers(1, 4))):
        paths = values_in(document)
        path = paths[int(rng.integers(len(paths)))]
        holder: Any = document
        for key in path[:-1]:
            holder = holder[key]
        if kind == 3:
            del holder[path[-1]]
        elif kind == 4 and isinstance(holder[path[-1]], int) and not isinstance(holder[path[-1]], bool):
            holder[path[-1]] += int(rng.integers(-3, 4))
        else:
            holder[path[-1]] = STRANGE[int(rng.integers(len(STRANGE)))]
    return container(document, binary)


def check_many(whole: Path, folder: Path, seeds: range) -> None:
    file, refused = folder / "a.glb", 0
    for seed in seeds:
        file.write_bytes(damaged(whole, np.random.default_rng(seed)))
        problems = check_glb(file)
        refused += bool(problems)
        for problem in problems:
            assert PLACE.match(problem), (seed, problem)
            assert "Traceback" not in problem
    assert refused > 0.6 * len(seeds)


def test_damaged_files_are_refused_in_words_or_harmless(whole: Path, tmp_path: Path) -> None:
    check_many(whole, tmp_path, range(200))


@pytest.mark.nightly
def test_a_thousand_damaged_files_are_refused_in_words_or_harmless(whole: Path, tmp_path: Path) -> None:
    check_many(whole, tmp_path, range(200, 1200))
