"""The geometry files between the export stages: sampled grids, surfaces, textured meshes. All are npz archives.

- `samples/grids.npz`: `GRIDS`, `CHART`, and of a model with a reflection or a torso `REFLECTION`, `TORSO`;
- `surfaces/surfaces.npz`: of `grid` `SHEETS` and `CHART`; of `poisson` vertices_00, faces_00, ... one pair a layer;
- `meshes/meshes.npz`: such pairs and st_00, layer-local texture coordinates.

Layers are outermost first. Every array is checked when it is read: shape, type, finite numbers, indices in range.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
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
from facefolds_core.geometry.torso import NUMBERS, Torso


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
        torso: what of the layers stays in the room while the head turns, or None.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    valid: NDArray[np.bool_]
    opacity: NDArray[np.uint8]
    windows: NDArray[np.float64]
    chart: Chart
    reflection: ReflectionMaps | None = None
    torso: Torso | None = None

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


TEXTURES = "textures.arrow"
"""Name of a frame store of textures, N layers x K frames, in its folder: they are many, and lie in no archive."""

Arrays = dict[str, NDArray[Any]]
Kinds = Mapping[str, tuple[type[np.generic], tuple[int | str, ...]]]
"""Name of an array -> its type and shape; a letter stands for one size wherever it stands."""

GRIDS: Kinds = {
    "points": (np.float32, ("N", "R", "R", 3)),
    "normals": (np.float32, ("N", "R", "R", 3)),
    "valid": (np.bool_, ("N", "R", "R")),
    "opacity": (np.uint8, ("N", "R", "R")),
    "windows": (np.float64, ("N", 4)),
}
REFLECTION: Kinds = {
    "reflection_window": (np.float64, (4,)),
    "reflection_gloss": (np.float32, ("h", "w")),
    "reflection_offset": (np.float32, ("h", "w", 3)),
    "reflection_normals": (np.float32, ("h", "w", 3)),
    "reflection_environment": (np.float32, ("e", "e", 3)),
}
SHEETS: Kinds = {
    "radii": (np.float32, ("N", "n", "n")),
    "st": (np.float64, ("n", "n", 2)),
    "valid": (np.bool_, ("N", "n", "n")),
    "opacity": (np.uint8, ("N", "n", "n")),
    "falling": (np.bool_, ("m", "m")),
    "window": (np.float64, (4,)),
}
CHART: Kinds = {"centre": (np.float64, (3,)), "belt": (np.float64, (2,))}
TORSO: Kinds = {"torso": (np.float64, (NUMBERS,))}
SURFACE: Kinds = {"vertices": (np.float32, ("V", 3)), "faces": (np.int32, ("F", 3))}
TEXTURED: Kinds = {**SURFACE, "st": (np.float32, ("V", 2))}


def write_grids(path: Path, grids: Grids) -> None:
    arrays = {name: getattr(grids, name) for name in GRIDS} | _chart_arrays(grids.chart)
    if grids.reflection is not None:
        arrays |= {f"reflection_{name}": np.asarray(value) for name, value in vars(grids.reflection).items()}
    if grids.torso is not None:
        arrays["torso"] = grids.torso.numbers
    _write(path, arrays)


def read_grids(path: Path) -> Grids:
    """Raises UserError if the file is missing, damaged or not what `write_grids` writes."""
    arrays = _read(path)
    taken = _take(arrays, path, GRIDS)
    _check_windows(taken["windows"], path)
    chart, reflection, torso = _take_chart(arrays, path), _take_reflection(arrays, path), _take_torso(arrays, path)
    return Grids(**taken, chart=chart, reflection=reflection, torso=torso)


def read_places(path: Path) -> tuple[list[Window], Chart, ReflectionMaps | None, Torso | None]:
    """Only windows, chart, reflection and torso in a file of `write_grids`; raises as `read_grids` does."""
    arrays = _read(path, {"windows", *CHART, *REFLECTION, *TORSO})
    windows = _take(arrays, path, {"windows": GRIDS["windows"]})["windows"]
    _check_windows(windows, path)
    places = [(float(u0), float(u1), float(v0), float(v1)) for u0, u1, v0, v1 in windows]
    return places, _take_chart(arrays, path), _take_reflection(arrays, path), _take_torso(arrays, path)


def _take_reflection(arrays: Arrays, path: Path) -> ReflectionMaps | None:
    if not arrays.keys() & REFLECTION.keys():
        return None
    taken = {name.removeprefix("reflection_"): array for name, array in _take(arrays, path, REFLECTION).items()}
    window = taken.pop("window")
    _check_windows(window[None], path)
    u0, u1, v0, v1 = window.tolist()
    return ReflectionMaps((u0, u1, v0, v1), **taken)


def _take_torso(arrays: Arrays, path: Path) -> Torso | None:
    if "torso" not in arrays:
        return None
    torso = Torso.of(_take(arrays, path, TORSO)["torso"])
    if not torso.sound:
        raise _damaged(path, "torso", "a normal and a quaternion of unit length, a band above 0", str(torso))
    return torso


def _chart_arrays(chart: Chart) -> Arrays:
    arrays = {"centre": np.array(chart.centre, np.float64)}
    if chart.belt is not None:
        arrays["belt"] = np.array([chart.belt.elevation, chart.belt.girth], np.float64)
    return arrays


def _take_chart(arrays: Arrays, path: Path) -> Chart:
    """Of files from before there were belts, too."""
    taken = _take(arrays, path, {name: kind for name, kind in CHART.items() if name == "centre" or name in arrays})
    x, y, z = taken["centre"].tolist()
    if "belt" not in taken:
        return Chart((x, y, z))
    belt = Belt(*taken["belt"].tolist())
    if not belt.sound:
        raise _damaged(path, "belt", f"one {Belt.BOUNDS}", taken["belt"].tolist())
    return Chart((x, y, z), belt)


def _check_windows(windows: NDArray[np.float64], path: Path) -> None:
    u0, u1, v0, v1 = windows.T
    if not ((u0 < u1).all() and (v0 < v1).all() and (np.abs(windows) <= 2).all()):
        expected = "(u0, u1, v0, v1) with -2 <= u0 < u1 <= 2 and likewise v"
        raise _damaged(path, "windows", expected, windows.tolist())


def write_sheets(path: Path, sheets: Sheets) -> None:
    arrays = {field.name: getattr(sheets, field.name) for field in fields(sheets) if field.name != "chart"}
    _write(path, arrays | _chart_arrays(sheets.chart))


def write_meshes(path: Path, meshes: Sequence[Surface]) -> None:
    """With texture coordinates where they have them."""
    _write(path, {f"{name}_{i:02d}": array for i, mesh in enumerate(meshes) for name, array in vars(mesh).items()})


def read_surfaces(path: Path) -> Sheets | list[Surface]:
    """Raises UserError if the file is missing, damaged or not what `write_sheets` or `write_meshes` writes."""
    arrays = _read(path)
    if "radii" not in arrays:
        return [Surface(**parts) for parts in _take_meshes(arrays, path, SURFACE)]
    taken = _take(arrays, path, SHEETS)
    n = len(taken["st"])
    if len(taken["falling"]) != n - 1:
        raise _damaged(path, "falling", f"bool {(n - 1, n - 1)}", taken["falling"].shape)
    sheets = Sheets(**taken, chart=_take_chart(arrays, path))
    _check_windows(sheets.window[None], path)
    if not ((sheets.radii > 0).all() and (np.diff(sheets.radii, axis=0) <= 0).all()):
        raise _damaged(path, "radii", "positive radii that fall from layer to layer", "others")
    return sheets


def read_meshes(path: Path) -> list[TexturedMesh]:
    """Raises UserError if the file is missing, damaged or not what `write_meshes` writes."""
    meshes = [TexturedMesh(**parts) for parts in _take_meshes(_read(path), path, TEXTURED)]
    for i, st in enumerate(mesh.st for mesh in meshes):
        if st.min() < 0 or st.max() > 1:
            raise _damaged(path, f"st_{i:02d}", "texture coordinates in [0, 1]", f"{st.min()} to {st.max()}")
    return meshes


def _take_meshes(arrays: Arrays, path: Path, kinds: Kinds) -> list[Arrays]:
    """The arrays of each mesh, without their numbers."""
    meshes = []
    for i in range(max(1, sum(name.startswith("vertices_") for name in arrays))):
        taken = _take(arrays, path, {f"{name}_{i:02d}": kind for name, kind in kinds.items()})
        parts = {name[:-3]: array for name, array in taken.items()}
        faces, count = parts["faces"], len(parts["vertices"])
        if faces.min() < 0 or faces.max() >= count:
            raise _damaged(path, f"faces_{i:02d}", f"indices below {count}", f"{faces.min()} to {faces.max()}")
        meshes.append(parts)
    return meshes


def _write(path: Path, arrays: Arrays) -> None:
    with atomic_file(path) as temporary:
        np.savez(temporary, **arrays)  # type: ignore[arg-type]  # numpy's stub takes the ** for its own keyword


def _read(path: Path, names: Collection[str] | None = None) -> Arrays:
    """The archive's arrays by name; all, or those of `names` that are there."""
    return read_npz(path, "a damaged geometry file", names)


def _damaged(path: Path, name: str, expected: object, found: object) -> UserError:
    return UserError(
        "a damaged geometry file", file=path, place=name, expected=expected, found=found, remedy=remake(path)
    )


def _take(arrays: Arrays, path: Path, kinds: Kinds) -> Arrays:
    """Those of `kinds`, each as it says, not empty, and finite."""
    sizes = dict[int | str, int]()
    for name, (kind, shape) in kinds.items():
        if name not in arrays:
            raise _damaged(path, name, "an array of this name", ", ".join(sorted(arrays)) or "nothing")
        array = arrays[name]
        for letter, size in zip(shape, array.shape, strict=False):
            sizes.setdefault(letter, letter if isinstance(letter, int) else size)
        wanted = tuple(sizes.get(letter, letter) for letter in shape)
        if array.shape != wanted or array.dtype != kind or array.size == 0:
            raise _damaged(path, name, f"{kind.__name__} {wanted}, not empty", f"{array.dtype} {array.shape}")
        if not np.isfinite(array).all():
            raise _damaged(path, name, "finite numbers", "NaN or infinity")
    return {name: arrays[name] for name in kinds}
