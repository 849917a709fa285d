"""The geometry files between the export stages: sampled grids, surfaces, textured meshes. All are npz archives.

- `samples/grids.npz`: points and normals (N, R, R, 3) float32, valid (N, R, R) bool, opacity (N, R, R) uint8,
  windows (N, 4) float64, centre (3,) float64, belt (2,) float64 if the chart has one; of a model with a reflection its
  arrays, as `reflection_gloss`, ...;
- `surfaces/surfaces.npz`: of `poisson` vertices_00 (V, 3) float32, faces_00 (F, 3) int32, ... one pair a layer; of
  `grid` the arrays of `Sheets`;
- `meshes/meshes.npz`: such pairs and st_00 (V, 2) float32, layer-local texture coordinates.

Layers are outermost first. Every array is checked when it is read: shape, type, finite numbers, indices in range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files.archives import read_npz
from facefolds_core.files.reading import remake
from facefolds_core.files.writing import atomic_file
from facefolds_core.geometry.chart import Belt, Chart
from facefolds_core.geometry.meshes import Surface, TexturedMesh
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window


@dataclass(frozen=True)
class Grids:
    """N grids of R x R samples; the sample (row i, column j) lies in the direction `texel_uv(R, R, window)[i, j]`.

    Attributes:
        points: (N, R, R, 3) float32; where a sample is not valid, anything finite.
        normals: (N, R, R, 3) float32, unit length, outward.
        valid: (N, R, R) bool: the layer has a point in this direction.
        opacity: (N, R, R) uint8: no frame's alpha is larger, as a code of 8 bits; 0 where not valid.
        windows: (N, 4) float64, (u0, u1, v0, v1) of each layer's grid.
        chart: the model's.
        reflection: what the model adds by the direction, or None.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    valid: NDArray[np.bool_]
    opacity: NDArray[np.uint8]
    windows: NDArray[np.float64]
    chart: Chart
    reflection: ReflectionMaps | None = None

    @property
    def num_layers(self) -> int:
        return len(self.points)

    @property
    def resolution(self) -> int:
        return int(self.points.shape[1])

    def window(self, layer: int) -> tuple[float, float, float, float]:
        u0, u1, v0, v1 = (float(x) for x in self.windows[layer])
        return u0, u1, v0, v1


@dataclass(frozen=True)
class Sheets:
    """All layers as radii over one grid of n x n directions, nested: radii never grow from a layer to the next.

    Attributes:
        st: (n, n, 2) float64, texture coordinates of the grid's vertices: rows down, columns right.
        radii: (N, n, n) float32, of the chart, outermost layer first; defined everywhere.
        valid: (N, n, n) bool: the layer has a point there.
        opacity: (N, n, n) uint8, as in `Grids`.
        falling: (n - 1, n - 1) bool: the cell's diagonal goes from its top left to its bottom right corner.
        window: (4,) float64, (u0, u1, v0, v1) of the texture coordinates.
        chart: of the radii.
    """

    st: NDArray[np.float64]
    radii: NDArray[np.float32]
    valid: NDArray[np.bool_]
    opacity: NDArray[np.uint8]
    falling: NDArray[np.bool_]
    window: NDArray[np.float64]
    chart: Chart

    @property
    def num_layers(self) -> int:
        return len(self.radii)


def write_grids(path: Path, grids: Grids) -> None:
    apart = ("reflection", "chart")
    arrays = {field.name: getattr(grids, field.name) for field in fields(grids) if field.name not in apart}
    arrays |= _chart_arrays(grids.chart)
    if grids.reflection is not None:
        arrays |= {f"reflection_{name}": np.asarray(value) for name, value in vars(grids.reflection).items()}
    _write(path, arrays)


def read_grids(path: Path) -> Grids:
    """Raises UserError if the file is missing, damaged or not what `write_grids` writes."""
    arrays = _read(path)
    n, r = _shape(arrays, path, "points", 2)[:2]
    grids = Grids(
        points=_take(arrays, path, "points", (n, r, r, 3), np.float32),
        normals=_take(arrays, path, "normals", (n, r, r, 3), np.float32),
        valid=_take(arrays, path, "valid", (n, r, r), np.bool_),
        opacity=_take(arrays, path, "opacity", (n, r, r), np.uint8),
        windows=_take(arrays, path, "windows", (n, 4), np.float64),
        chart=_take_chart(arrays, path),
    )
    _check_windows(grids.windows, path)
    return replace(grids, reflection=read_reflection_maps(path))


def read_reflection_maps(path: Path) -> ReflectionMaps | None:
    """Only the reflection in a file of `write_grids`, None where there is none; raises as `read_grids` does."""
    arrays = _read(path, {f"reflection_{field.name}" for field in fields(ReflectionMaps)})
    if not arrays:
        return None
    window = _take(arrays, path, "reflection_window", (4,), np.float64)
    _check_windows(window[None], path)
    h, w = _shape(arrays, path, "reflection_gloss", 2)[:2]
    e = _shape(arrays, path, "reflection_environment", 2)[0]
    u0, u1, v0, v1 = (float(x) for x in window)
    return ReflectionMaps(
        window=(u0, u1, v0, v1),
        gloss=_take(arrays, path, "reflection_gloss", (h, w), np.float32),
        offset=_take(arrays, path, "reflection_offset", (h, w, 3), np.float32),
        normals=_take(arrays, path, "reflection_normals", (h, w, 3), np.float32),
        environment=_take(arrays, path, "reflection_environment", (e, e, 3), np.float32),
    )


def read_windows(path: Path) -> list[Window]:
    """Only the windows (u0, u1, v0, v1) of the layers in a file of `write_grids`; raises as `read_grids` does."""
    arrays = _read(path, {"windows"})
    windows = _take(arrays, path, "windows", (len(arrays.get("windows", ())), 4), np.float64)
    _check_windows(windows, path)
    return [(float(u0), float(u1), float(v0), float(v1)) for u0, u1, v0, v1 in windows]


def read_chart(path: Path) -> Chart:
    """Only the chart in a file of `write_grids`; raises as `read_grids` does."""
    return _take_chart(_read(path, {"centre", "belt"}), path)


def _chart_arrays(chart: Chart) -> dict[str, NDArray[Any]]:
    arrays = {"centre": np.array(chart.centre, np.float64)}
    if chart.belt is not None:
        arrays["belt"] = np.array([chart.belt.elevation, chart.belt.girth], np.float64)
    return arrays


def _take_chart(arrays: dict[str, NDArray[Any]], path: Path) -> Chart:
    """Of files from before there were belts, too."""
    x, y, z = (float(value) for value in _take(arrays, path, "centre", (3,), np.float64))
    if "belt" not in arrays:
        return Chart((x, y, z))
    elevation, girth = (float(value) for value in _take(arrays, path, "belt", (2,), np.float64))
    belt = Belt(elevation, girth)
    if not belt.sound:
        raise _damaged(path, "belt", f"one {Belt.BOUNDS}", [elevation, girth])
    return Chart((x, y, z), belt)


def _check_windows(windows: NDArray[np.float64], path: Path) -> None:
    u0, u1, v0, v1 = windows.T
    if not ((u0 < u1).all() and (v0 < v1).all() and (np.abs(windows) <= 2).all()):
        expected = "(u0, u1, v0, v1) with -2 <= u0 < u1 <= 2 and likewise v"
        raise _damaged(path, "windows", expected, windows.tolist())


def write_surfaces(path: Path, surfaces: Sequence[Surface]) -> None:
    arrays: dict[str, NDArray[Any]] = {}
    for i, surface in enumerate(surfaces):
        arrays |= {f"vertices_{i:02d}": surface.vertices, f"faces_{i:02d}": surface.faces}
    _write(path, arrays)


def read_surfaces(path: Path) -> list[Surface]:
    """Raises UserError if the file is missing, damaged or not what `write_surfaces` writes."""
    arrays = _read(path)
    return [_surface(arrays, path, i) for i in range(_count(arrays, path))]


def write_sheets(path: Path, sheets: Sheets) -> None:
    arrays = {field.name: getattr(sheets, field.name) for field in fields(sheets) if field.name != "chart"}
    _write(path, arrays | _chart_arrays(sheets.chart))


def holds_sheets(path: Path) -> bool:
    """Whether a file of surfaces was written by `write_sheets`; raises as `read_sheets` does."""
    return "radii" in _read(path, {"radii"})


def read_sheets(path: Path) -> Sheets:
    """Raises UserError if the file is missing, damaged or not what `write_sheets` writes."""
    arrays = _read(path)
    layers, n = _shape(arrays, path, "radii", 2)[:2]
    sheets = Sheets(
        st=_take(arrays, path, "st", (n, n, 2), np.float64),
        radii=_take(arrays, path, "radii", (layers, n, n), np.float32),
        valid=_take(arrays, path, "valid", (layers, n, n), np.bool_),
        opacity=_take(arrays, path, "opacity", (layers, n, n), np.uint8),
        falling=_take(arrays, path, "falling", (n - 1, n - 1), np.bool_),
        window=_take(arrays, path, "window", (4,), np.float64),
        chart=_take_chart(arrays, path),
    )
    _check_windows(sheets.window[None], path)
    if not ((sheets.radii > 0).all() and (np.diff(sheets.radii, axis=0) <= 0).all()):
        raise _damaged(path, "radii", "positive radii that fall from layer to layer", "others")
    return sheets


def write_meshes(path: Path, meshes: Sequence[TexturedMesh]) -> None:
    arrays: dict[str, NDArray[Any]] = {}
    for i, mesh in enumerate(meshes):
        arrays |= {f"vertices_{i:02d}": mesh.vertices, f"faces_{i:02d}": mesh.faces, f"st_{i:02d}": mesh.st}
    _write(path, arrays)


def read_meshes(path: Path) -> list[TexturedMesh]:
    """Raises UserError if the file is missing, damaged or not what `write_meshes` writes."""
    arrays = _read(path)
    meshes = []
    for i in range(_count(arrays, path)):
        surface = _surface(arrays, path, i)
        st = _take(arrays, path, f"st_{i:02d}", (len(surface.vertices), 2), np.float32)
        if st.min() < 0 or st.max() > 1:
            raise _damaged(path, f"st_{i:02d}", "texture coordinates in [0, 1]", f"{st.min()} to {st.max()}")
        meshes.append(TexturedMesh(surface.vertices, surface.faces, st))
    return meshes


def _write(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    with atomic_file(path) as temporary:
        np.savez(temporary, **arrays)  # type: ignore[arg-type]  # numpy's stub takes the ** for its own keyword


def _read(path: Path, names: set[str] | None = None) -> dict[str, NDArray[Any]]:
    """The archive's arrays by name; all, or those of `names` that are there."""
    return read_npz(path, "a damaged geometry file", names)


def _damaged(path: Path, name: str, expected: object, found: object) -> UserError:
    return UserError(
        "a damaged geometry file", file=path, place=name, expected=expected, found=found, remedy=remake(path)
    )


def _shape(arrays: dict[str, NDArray[Any]], path: Path, name: str, axes: int = 1) -> tuple[int, ...]:
    if name not in arrays:
        raise _damaged(path, name, "an array of this name", ", ".join(sorted(arrays)) or "nothing")
    if arrays[name].ndim < axes or 0 in arrays[name].shape:
        raise _damaged(path, name, "an array that is not empty", arrays[name].shape)
    return arrays[name].shape


def _take(
    arrays: dict[str, NDArray[Any]], path: Path, name: str, shape: tuple[int, ...], kind: type[np.generic]
) -> NDArray[Any]:
    _shape(arrays, path, name)
    array = arrays[name]
    if array.shape != shape or array.dtype != kind:
        raise _damaged(path, name, f"{kind.__name__} {shape}", f"{array.dtype} {array.shape}")
    if not np.isfinite(array).all():
        raise _damaged(path, name, "finite numbers", "NaN or infinity")
    return array


def _count(arrays: dict[str, NDArray[Any]], path: Path) -> int:
    count = sum(name.startswith("vertices_") for name in arrays)
    if count == 0:
        raise _damaged(path, "vertices_00", "an array of this name", ", ".join(sorted(arrays)) or "nothing")
    return count


def _surface(arrays: dict[str, NDArray[Any]], path: Path, layer: int) -> Surface:
    vertices_name, faces_name = f"vertices_{layer:02d}", f"faces_{layer:02d}"
    vertices = _take(arrays, path, vertices_name, (_shape(arrays, path, vertices_name)[0], 3), np.float32)
    faces = _take(arrays, path, faces_name, (_shape(arrays, path, faces_name)[0], 3), np.int32)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise _damaged(path, faces_name, f"indices below {len(vertices)}", f"{faces.min()} to {faces.max()}")
    return Surface(vertices, faces)
