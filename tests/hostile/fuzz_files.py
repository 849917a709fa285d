"""Damaged files between the stages, through the readers that the stages use.

npz archives have checksums: what is accepted must be what was written. Frame stores, safetensors and JSON have none: a
change that makes another valid file is found by DVC, which hashes them, and is no defect here.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch

from facefolds_core.captures.scene import read_scene, write_scene
from facefolds_core.config.params_file import Params, write_configs
from facefolds_core.config.stages import read_subject, read_train
from facefolds_core.export.sampling import sample_grids
from facefolds_core.export.sheets import grid_sheets
from facefolds_core.export.stores import (
    Grids,
    Sheets,
    read_grids,
    read_meshes,
    read_places,
    read_surfaces,
    write_grids,
    write_meshes,
    write_sheets,
)
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.model.storage import build_model, load_model, save_model
from facefolds_core.params import Subject
from facefolds_core.reporting.facts import read_images
from facefolds_core.subject.cameras import CameraFit
from facefolds_core.subject.splats import COLUMNS, Splats
from facefolds_core.subject.storage import FoundSubject, read_found, write_found
from tests.captures.test_scene import scene as scene_of_two_frames
from tests.ellipsoids import Ellipsoids
from tests.hostile.damage import Counts, attempt, fingerprint
from tests.hostile.structured import damage_bytes, damage_json, damage_path
from tests.scoring.fakes import SPEC

SECONDS = 10


@dataclass(frozen=True)
class Kind:
    """Files of one kind.

    Attributes:
        names: in data/head; one of them is damaged.
        read: all of them; returns what is in them, None where nothing is.
        compared: whether that must be what was written.
    """

    names: tuple[str, ...]
    read: Callable[[Path], Any]
    compared: bool = True


def _store(folder: Path) -> None:
    store = FrameStore(folder / "scene" / "frames.arrow")
    for key in [(0, 0), (0, 1), (1, 0)]:
        np.array(store.image(*key))


def _scene(folder: Path) -> None:
    scene = read_scene(folder / "scene")
    scene.open_frames()
    for camera in scene.cameras:
        camera.rays(np.zeros((1, 2)))
        camera.transformed(scene.from_capture.inverse())


def _gaussians(folder: Path) -> Any:
    found = read_found(folder / "subject" / "gaussians.npz", 1)
    return [found.splats.values, np.array(found.psnr), found.cameras.measured, found.cameras.errors]


def _parts(stored: Grids | Sheets) -> list[Any]:
    return [repr(part) if isinstance(part, Chart) else part for part in vars(stored).values()]


def _grids(folder: Path) -> Any:
    path = folder / "samples" / "grids.npz"
    return [*_parts(read_grids(path)), *map(repr, read_places(path)[:2])]


def _surfaces(folder: Path) -> Any:
    return [part for s in read_surfaces(folder / "surfaces" / "surfaces.npz") for part in (s.vertices, s.faces)]


def _meshes(folder: Path) -> Any:
    return [part for m in read_meshes(folder / "meshes" / "meshes.npz") for part in vars(m).values()]


KINDS = (
    Kind(("scene/frames.arrow",), _store, False),
    Kind(("scene/scene.json",), _scene, False),
    Kind(("scene/surface.npz",), lambda folder: scene_of_two_frames(folder / "scene").load_surface()),
    Kind(("subject/gaussians.npz",), _gaussians),
    Kind(("samples/grids.npz",), _grids),
    Kind(("surfaces/sheets.npz",), lambda folder: _parts(read_surfaces(folder / "surfaces" / "sheets.npz"))),
    Kind(("surfaces/surfaces.npz",), _surfaces),
    Kind(("meshes/meshes.npz",), _meshes),
    Kind(("model/model.safetensors", "model/model.json"), lambda folder: load_model(folder / "model"), False),
    Kind(("config/train.json",), lambda folder: read_train(folder / "config"), False),
    Kind(("config/entry.json",), lambda folder: read_subject(folder / "config"), False),
    Kind(("evaluation/per_image.parquet",), lambda folder: read_images(folder / "evaluation/per_image.parquet"), False),
)


def make(root: Path) -> None:
    """One file of each kind."""
    for kind in KINDS:
        for name in kind.names:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(0)
    rows = [(c, f, random.integers(0, 256, (8, 10, 3), dtype=np.uint8)) for c in range(2) for f in range(2)]
    write_frames(root / "scene" / "frames.arrow", (8, 10, 3), rows)
    write_scene(scene_of_two_frames(root / "scene"), root / "scene")
    vertices, faces = random.normal(size=(2, 5, 3)).astype(np.float32), np.array([[0, 1, 2], [2, 3, 4]], np.int32)
    np.savez(root / "scene" / "surface.npz", vertices=vertices, faces=faces)
    splats = Splats(random.normal(size=(7, COLUMNS)).astype(np.float32), np.zeros(3, np.float32))
    fit = CameraFit(np.full((1, 3), 1.5), np.full(1, 0.1))
    write_found(root / "subject" / "gaussians.npz", FoundSubject(splats, 30.0, fit))
    grids = sample_grids(Ellipsoids(), 6, (-0.5, 0.5, -0.5, 0.5))
    grids = replace(grids, chart=Chart(grids.chart.centre, Belt(0.8, 0.3)))
    write_grids(root / "samples" / "grids.npz", grids)
    write_sheets(root / "surfaces" / "sheets.npz", grid_sheets(grids, None))
    mesh = TexturedMesh(vertices[0], faces, random.random((5, 2)).astype(np.float32))
    write_meshes(root / "surfaces" / "surfaces.npz", [mesh, mesh])
    write_meshes(root / "meshes" / "meshes.npz", [mesh, mesh])
    torch.manual_seed(0)
    save_model(build_model(SPEC), SPEC, root / "model")
    subject = Subject(source="actor", path="x")
    write_configs(Params(subjects={"head": subject}, sections={}, path="params.yaml"), "head", root / "config")
    columns = {"camera": ["a", "b"], "frame": ["1", "1"], "variant": ["asset"] * 2, "psnr": [30.0, 31.0]}
    pq.write_table(pa.table({**columns, "psnr_subject": [20.0, None]}), root / "evaluation" / "per_image.parquet")


def damage(path: Path, random: np.random.Generator) -> str:
    """Damage a file's bytes, its values, or what stands in its place."""
    choice = random.random()
    if choice < 0.15:
        return damage_path(path, random)
    return (damage_json if path.suffix == ".json" and choice < 0.8 else damage_bytes)(path, random)


def same(one: Any, other: Any) -> bool:
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def run(count: int, seed: int, folder: Path) -> Counts:
    """`count` damaged files, one at a time, of all kinds by turns."""
    counts = Counts()
    whole, root = folder / "whole", folder / "data" / "head"
    make(whole)
    sound = [kind.read(whole) for kind in KINDS]
    shutil.copytree(whole, root)
    for i in range(count):
        random = np.random.default_rng([seed, i])
        number = i % len(KINDS)
        path = root / str(random.choice(KINDS[number].names))
        what = f"files, seed {seed}, case {i}, {path.relative_to(root)}, {damage(path, random)}"
        before = fingerprint(root)
        try_one(counts, what, KINDS[number], root, sound[number])
        if fingerprint(root) != before:
            counts.harmed.append(what)
        shutil.rmtree(root)
        shutil.copytree(whole, root)
    return counts


def try_one(counts: Counts, what: str, kind: Kind, root: Path, sound: Any) -> None:
    """Read one damaged file, and count what became of it."""
    result, found = attempt(counts, what, SECONDS, lambda: kind.read(root))
    if found and kind.compared and found[0] is not None and not same(found[0], sound):
        counts.kept_wrong.append(f"{what}: not what was written")
    if result.kind == "refused" and "remedy:" not in result.text:
        counts.kept_wrong.append(f"{what}: no remedy: {result.text}")
