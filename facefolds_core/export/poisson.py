"""Screened Poisson reconstruction of each layer from its samples, trimmed to the sampled sheet.

Kazhdan and Hoppe 2013 through pymeshlab. Poisson closes an open sheet; what it adds lies far from the samples and is
cut away by distance, measured in local sample spacings. Density trimming was measured to be worse. One thread a layer
makes the result the same, bit for bit, from run to run; layers run side by side in processes of their own.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial
from itertools import repeat

import numpy as np
from loky import ProcessPoolExecutor
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from facefolds_core.errors import UserError
from facefolds_core.export.stores import Grids
from facefolds_core.geometry.meshes import Surface
from facefolds_core.geometry.sphere_uv import row_strides
from facefolds_core.params import ReconstructParams
from facefolds_core.progress import progress
from facefolds_core.system.processes import end_with_parent

POINT_WEIGHT = 4.0
"""Weight of the samples (screening)."""

TRIM = 2.0
"""Vertices farther than this many local sample spacings from the samples are removed."""

TRIM_EDGES = 1.5
"""Vertices within this many mean edges of the samples stay."""

MIN_SAMPLES = 16
"""Fewer valid samples than this make no surface."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """Oriented points of one layer, about evenly spread over its surface.

    Attributes:
        points, normals: (M, 3) float64.
        spacing: (M,) distance to the farthest of the up to four neighbours in the grid.
    """

    points: Array
    normals: Array
    spacing: Array


def reconstruct_layers(grids: Grids, params: ReconstructParams) -> list[Surface]:
    """All layers, outermost first, on as many processes as there are processors (at most one a layer).

    Raises:
        UserError: if pymeshlab cannot be loaded, or a layer has too few samples or yields no surface; names the layer.
    """
    n = grids.num_layers
    jobs = [gather_samples(grids, i, params.resolution) for i in range(n)], repeat(params), range(n)
    workers = min(n, os.cpu_count() or 1)
    bar = partial(progress, total=n, desc="surfaces", unit="layer")
    if workers == 1:
        return list(bar(map(reconstruct, *jobs)))
    with ProcessPoolExecutor(workers, initializer=end_with_parent) as pool:
        return list(bar(pool.map(reconstruct, *jobs)))


def gather_samples(grids: Grids, layer: int, resolution: int | None) -> Samples:
    """Thin a layer's grid to about `resolution` samples a side, and further along each row towards the poles.

    At u = +-1 all columns meet in one point: a row keeps every k-th column, k = 1 / cos(elevation), so that samples are
    as far apart along the rows as along the columns. Poisson would else take the crowd at the poles for detail.

    Args:
        layer: its index.
        resolution: None keeps every row.
    """
    points, normals, valid, window = grids.points[layer], grids.normals[layer], grids.valid[layer], grids.window(layer)
    r = grids.resolution
    step = 1 if resolution is None else max(1, round(r / resolution))
    first = (r - 1) % step // 2
    strides = row_strides(r, window, grids.chart.lowest) * step
    columns = np.arange(r)
    keep = ((columns[None] - (first + (r - 1 - first) % strides // 2)[:, None]) % strides[:, None]) == 0
    keep &= ((columns - first) % step == 0)[:, None]
    chosen = keep & valid
    spacing = _spacing(points.astype(np.float64), valid, step, strides)
    return Samples(points[chosen].astype(np.float64), normals[chosen].astype(np.float64), spacing[chosen])


def _spacing(p: Array, valid: NDArray[np.bool_], step: int, strides: NDArray[np.intp]) -> Array:
    """(R, R): largest distance to the valid neighbours `step` rows or `strides` columns away; 0 without any."""
    r = len(p)
    rows, columns = np.meshgrid(np.arange(r), np.arange(r), indexing="ij")
    across = np.broadcast_to(strides[:, None], (r, r))
    largest = np.zeros((r, r))
    for di, dj in ((step, 0), (-step, 0), (0, across), (0, -across)):
        i, j = rows + di, columns + dj
        inside = (i >= 0) & (i < r) & (j >= 0) & (j < r)
        i, j = i.clip(0, r - 1), j.clip(0, r - 1)
        distance = np.linalg.norm(p[i, j] - p, axis=-1)
        largest = np.maximum(largest, np.where(inside & valid[i, j], distance, 0))
    return largest


def reconstruct(samples: Samples, params: ReconstructParams, layer: int) -> Surface:
    """Poisson, trimming, largest component.

    Args:
        samples: of the layer.
        layer: its index, for messages.

    Raises:
        UserError: see `reconstruct_layers`.
    """
    wrong = partial(UserError, place=f"layer {layer} (0 is the outermost)")
    if len(samples.points) < MIN_SAMPLES:
        raise wrong(
            "a layer has too few samples for a surface",
            expected=f"at least {MIN_SAMPLES} valid samples",
            found=len(samples.points),
            remedy="raise sample.resolution or reconstruct.resolution, or train longer or with fewer layers",
        )
    vertices, faces = screened_poisson(samples.points, samples.normals, params.depth)
    if len(faces):
        vertices, faces = trim(vertices, faces, samples)
    if len(faces) == 0:
        raise wrong(
            "Poisson reconstruction gave no surface near the samples",
            expected="a sheet through the samples",
            found="nothing",
            remedy="raise reconstruct.depth, or look at the layer's samples in samples/grids.npz",
        )
    faces = _outward(vertices, faces, samples)
    return Surface(vertices.astype(np.float32), faces.astype(np.int32))


def screened_poisson(points: Array, normals: Array, depth: int) -> tuple[Array, NDArray[np.intp]]:
    """Screened Poisson surface of oriented points (M, 3): vertices (V, 3) and faces (F, 3), not trimmed.

    Raises:
        UserError: if pymeshlab cannot be loaded.
    """
    try:
        import pymeshlab
    except ImportError as error:
        raise UserError(
            "pymeshlab, which reconstructs the surfaces, cannot be loaded",
            expected="pymeshlab and the OpenGL library libGL.so.1",
            found=str(error),
            remedy="install libGL (Debian, Ubuntu: `apt-get install libgl1`), and `pip install pymeshlab`",
        ) from None
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    try:
        meshes.generate_surface_reconstruction_screened_poisson(
            depth=depth, pointweight=POINT_WEIGHT, samplespernode=1.5, scale=1.1, threads=1, preclean=False
        )
    except pymeshlab.PyMeshLabException:
        # Samples that bound nothing (all in one point, say): the caller says what that means.
        return np.zeros((0, 3)), np.zeros((0, 3), np.intp)
    mesh = meshes.current_mesh()
    return np.asarray(mesh.vertex_matrix(), np.float64), np.asarray(mesh.face_matrix(), np.intp)


def trim(vertices: Array, faces: NDArray[np.intp], samples: Samples) -> tuple[Array, NDArray[np.intp]]:
    """Keep what lies near the samples, and of that the largest component.

    Args:
        vertices, faces: (V, 3), (F, 3) of the closed surface.

    Returns:
        vertices and faces, the latter possibly none.
    """
    edges = vertices[faces[:, 1]] - vertices[faces[:, 0]]
    least = TRIM_EDGES * float(np.linalg.norm(edges, axis=-1).mean())
    distance, nearest = cKDTree(samples.points).query(vertices)
    near = distance <= np.maximum(TRIM * samples.spacing[nearest], least)
    return compact(vertices, largest_component(faces[near[faces].all(1)], len(vertices)))


def largest_component(faces: NDArray[np.intp], num_vertices: int) -> NDArray[np.intp]:
    """Faces (F, 3) of the edge-connected component that has most of them.

    Parts that share only a vertex are apart: keeping both would leave a vertex where the sheet is not a surface.
    """
    if len(faces) == 0:
        return faces
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1)
    _, edge = np.unique(edges[:, 0] * num_vertices + edges[:, 1], return_inverse=True)
    face = np.repeat(np.arange(len(faces)), 3)
    links = coo_matrix((np.ones(len(edge), np.int8), (face, edge + len(faces))), shape=(len(faces) + len(edge),) * 2)
    _, label = connected_components(links, directed=False)
    label = label[: len(faces)]
    return np.asarray(faces[label == np.bincount(label).argmax()])


def compact(vertices: Array, faces: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Drop vertices that no face uses."""
    used, index = np.unique(faces, return_inverse=True)
    return vertices[used], index.reshape(-1, 3)


def _outward(vertices: Array, faces: NDArray[np.intp], samples: Samples) -> NDArray[np.intp]:
    """Turn all faces round if most of them face against the samples' normals."""
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, nearest = cKDTree(samples.points).query(corners.mean(1))
    agrees = (normal * samples.normals[nearest]).sum()
    return faces if agrees >= 0 else faces[:, ::-1]
