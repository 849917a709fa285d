"""Radii at the vertices of a decimated triangulation, fitted to all samples.

Along a direction d = sum_k a_k d_k in a triangle's cone the mesh lies at 1/t = sum_k a_k / rho_k (see `sheets`): linear
in the inverse radii. So each layer's are the solution of a sparse linear least-squares problem. A sample's residual is
weighted by how much it shows and by the cosine between the surface's normal and d, which turns a distance along d into
one from the surface: a steep place may be off along d without being off.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import spsolve

from facefolds_core.export.collapse_kernel import locate
from facefolds_core.export.sheets import Array
from facefolds_core.export.stores import Sheets
from facefolds_core.geometry.sphere_uv import st_to_uv
from facefolds_core.params import RefitParams


def refit_radii(sheets: Sheets, shows: Array, faces: NDArray[np.int64], towards: Array, params: RefitParams) -> Sheets:
    """The same sheets with new radii at the vertices that `faces` use, nested as before.

    Args:
        shows: (N, n, n) weights of the samples.
        faces: (F, 3) over the grid's vertices.
        towards: (n n, 3) unit directions of the grid's vertices.
    """
    face = locate(faces, len(sheets.st)).reshape(-1)
    inside = face >= 0
    used, index = np.unique(faces, return_inverse=True)
    corners = faces[face[inside]]
    shares = np.linalg.solve(towards[corners].transpose(0, 2, 1), towards[inside][..., None])[..., 0]
    rows = np.arange(0, 3 * len(corners) + 1, 3)
    columns = index.reshape(-1, 3)[face[inside]].reshape(-1)
    matrix = csr_matrix((shares.reshape(-1), columns, rows), shape=(len(corners), len(used)))
    fitted = np.empty((sheets.num_layers, len(used)))
    for layer, radii in enumerate(sheets.radii.reshape(sheets.num_layers, -1).astype(np.float64)):
        cosines = radial_cosines(sheets, layer).reshape(-1)
        weight = shows[layer].reshape(-1) + params.empty_weight
        weights = (weight * np.maximum(cosines, params.min_cosine) ** 2)[inside]
        normal = matrix.T @ diags(weights) @ matrix
        stay = diags(params.stay * normal.diagonal() + 1e-6)
        right = matrix.T @ (weights / radii[inside]) + stay @ (1 / radii[used])
        fitted[layer] = 1 / spsolve((normal + stay).tocsc(), right)
    result = sheets.radii.reshape(sheets.num_layers, -1).copy()
    result[:, used] = np.minimum.accumulate(fitted, 0)
    return Sheets(**{**vars(sheets), "radii": result.reshape(sheets.radii.shape)})


def radial_cosines(sheets: Sheets, layer: int) -> Array:
    """(n, n) cosines between a layer's normals and directions from c: 1 / sqrt(1 + |grad ln rho|^2) on the sphere."""
    u0, u1, v0, v1 = (float(x) for x in sheets.window)
    uv = st_to_uv(sheets.st, (u0, u1, v0, v1)) * (math.pi / 2)
    logarithm = np.log(sheets.radii[layer].astype(np.float64))
    down = np.gradient(logarithm, uv[:, 0, 0], axis=0)
    right = np.gradient(logarithm, uv[0, :, 1], axis=1) / np.maximum(np.cos(uv[..., 0]), 1e-6)
    return np.asarray(1 / np.sqrt(1 + down**2 + right**2))
