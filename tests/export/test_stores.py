"""Geometry files: round trips, and what damaged ones say."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.errors import UserError
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
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.meshes import Surface, TexturedMesh
from facefolds_core.geometry.torso import Torso
from tests.assets import TORSO
from tests.ellipsoids import Ellipsoids

TRIANGLE = TexturedMesh(
    np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), np.array([[0, 0], [0.5, 1], [1, 0]], np.float32)
)


@pytest.fixture(scope="module")
def grids() -> Grids:
    return sample_grids(Ellipsoids(), 8, (-0.5, 0.5, -0.5, 0.5))


BELTS = pytest.mark.parametrize("belt", [None, Belt(0.2, 0.3)])


@BELTS
@pytest.mark.parametrize("torso", [None, TORSO])
def test_grids_round_trip(tmp_path: Path, grids: Grids, belt: Belt | None, torso: Torso | None) -> None:
    """Chart and torso can be read without the samples."""
    path, chart = tmp_path / "grids.npz", Chart((0.1, 0.2, 0.3), belt)
    write_grids(path, replace(grids, chart=chart, torso=torso))
    back = read_grids(path)
    for name in ("points", "normals", "valid", "opacity", "windows"):
        assert np.array_equal(getattr(back, name), getattr(grids, name))
    places = read_places(path)
    assert places[1] == back.chart == chart and places[3] == back.torso == torso


def test_meshes_and_surfaces_round_trip_and_are_the_same_bytes_each_time(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        write_meshes(tmp_path / name, [TRIANGLE, TRIANGLE])
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    first, second = read_meshes(tmp_path / "a.npz")
    assert np.array_equal(second.st, TRIANGLE.st)
    assert np.array_equal(first.faces, TRIANGLE.faces)
    write_meshes(tmp_path / "surfaces.npz", [Surface(TRIANGLE.vertices, TRIANGLE.faces)])
    (back,) = read_surfaces(tmp_path / "surfaces.npz")
    assert np.array_equal(back.vertices, TRIANGLE.vertices)


@BELTS
def test_sheets_round_trip(tmp_path: Path, grids: Grids, belt: Belt | None) -> None:
    sheets = replace(grid_sheets(grids, None), chart=Chart((0.1, 0.2, 0.3), belt))
    write_sheets(tmp_path / "sheets.npz", sheets)
    back = read_surfaces(tmp_path / "sheets.npz")
    assert isinstance(back, Sheets)
    for field in fields(sheets):
        assert np.array_equal(getattr(back, field.name), getattr(sheets, field.name))


@pytest.mark.parametrize("length", [0, 10, 500, 2000])
def test_a_truncated_file_is_an_error(tmp_path: Path, grids: Grids, length: int) -> None:
    path = tmp_path / "grids.npz"
    write_grids(path, grids)
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(UserError, match=r"grids\.npz"):
        read_grids(path)


def test_what_is_missing_a_lone_array_or_pickled_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "grids.npz").open("wb") as file:
        np.save(file, np.zeros(3))
    np.savez(tmp_path / "meshes.npz", vertices_00=np.array([{}], object))
    with pytest.raises(UserError, match=r"surfaces\.npz"):
        read_surfaces(tmp_path / "surfaces.npz")
    with pytest.raises(UserError, match="damaged"):
        read_grids(tmp_path / "grids.npz")
    with pytest.raises(UserError, match="damaged"):
        read_meshes(tmp_path / "meshes.npz")


WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("grids", {"points": np.zeros((2, 8, 8, 2), np.float32)}, "points"),
    ("grids", {"normals": np.full((2, 8, 8, 3), np.nan, np.float32)}, "normals"),
    ("grids", {"valid": np.ones((2, 8, 8), np.uint8)}, "valid"),
    ("grids", {"opacity": np.ones((2, 8, 8), bool)}, "opacity"),
    ("grids", {"chart": Chart((0.0, np.nan, 0.0))}, "centre"),
    ("grids", {"torso": replace(TORSO, normal=(0.0, 0.0, 2.0))}, "torso"),
    ("grids", {"windows": np.tile([0.5, -0.5, -1.0, 1.0], (2, 1))}, "windows"),
    ("sheets", {"radii": np.ones((2, 8, 7), np.float32)}, "radii"),
    ("sheets", {"radii": np.zeros((2, 8, 8), np.float32)}, "radii"),
    ("sheets", {"radii": np.array([1, 2], np.float32)[:, None, None] * np.ones((8, 8), np.float32)}, "radii"),
    ("sheets", {"st": np.full((8, 8, 2), np.inf)}, "st"),
    ("sheets", {"falling": np.ones((8, 8), bool)}, "falling"),
    ("meshes", {"vertices": np.full((3, 3), np.nan, np.float32)}, "vertices_00"),
    ("meshes", {"faces": np.array([[0, 1, 3]], np.int32)}, "faces_00"),
    ("meshes", {"faces": np.zeros((0, 3), np.int32)}, "faces_00"),
    ("meshes", {"st": np.array([[0, 0], [0.5, 1], [1.5, 0]], np.float32)}, "st_00"),
    ("meshes", {"st": np.zeros((2, 2), np.float32)}, "st_00"),
]


@pytest.mark.parametrize(("kind", "change", "place"), WRONG)
def test_wrong_arrays_are_named(tmp_path: Path, grids: Grids, kind: str, change: dict[str, Any], place: str) -> None:
    path, read = tmp_path / "file.npz", {"grids": read_grids, "sheets": read_surfaces, "meshes": read_meshes}[kind]
    if kind == "grids":
        write_grids(path, replace(grids, **change))
    elif kind == "sheets":
        write_sheets(path, replace(grid_sheets(grids, None), **change))
    else:
        write_meshes(path, [replace(TRIANGLE, **change)])
    with pytest.raises(UserError, match=place):
        read(path)
