"""Radii at the vertices of a decimated triangulation, fitted to all samples.

Along a direction d = sum_k a_k d_k in a triangle's cone the mesh lies at 1/t = sum_k a_k / rho_k (see `sheets`): linear
in the inverse radii. So each layer's are the solution of a sparse linear least-squares problem. Below a chart's belt,
where rays slide down an axis, it is the radius itself that is linear: of the point of the triangle that has the shares
b_k of (u, v), as far as it lies along d, sum_k b_k (rho_k d_k + o_k - o) . d, o being the rays' origins. (On a column
that is the chord's distance, up to fourth order in the angle.) There 1 / rho_k is taken to first order around the
samples' radii. A sample's residual is weighted by how much it shows and by the cosine
between the surface's normal and d, which turns a distance along d into one from the surface: a steep place may be off
along d without being off.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import spsolve

from facefolds_core.export.sheets import Array, vertex_uv
from facefolds_core.export.stores import Sheets
from facefolds_core.kernels.jit import inlined, kernel

STAY = 0.1
"""Pull towards the sample's own radius, as a share of what the samples around a vertex weigh."""

MIN_COSINE = 0.02
"""Least cosine that is reckoned with between a normal and the direction to c."""

EMPTY_WEIGHT = 0.0001
"""Weight of a place that never shows."""

LOOSE = 0.1
"""Share of a radius by which a vertex may lie outside of what the samples around it have; with 0.02 the actor loses
0.06 dB. Beside a wall, or where few samples show, least squares alone would overshoot without end."""


def refit_radii(sheets: Sheets, shows: Array, faces: NDArray[np.int64], uv: Array) -> Sheets:
    """The same sheets with new radii at the vertices that `faces` use, nested as before.

    Args:
        shows: (N, n, n) weights of the samples.
        faces: (F, 3) over the grid's vertices.
        uv: (n n, 2) of the grid's vertices.
    """
    face = locate(faces, len(sheets.st)).reshape(-1)
    inside = face >= 0
    used, index = np.unique(faces, return_inverse=True)
    corners = faces[face[inside]]
    shares, slides, below = _shares(sheets, uv, corners, inside)
    rows = np.arange(0, 3 * len(corners) + 1, 3)
    columns = index.reshape(-1, 3)[face[inside]].reshape(-1)
    fitted = np.empty((sheets.num_layers, len(used)))
    for layer, radii in enumerate(sheets.radii.reshape(sheets.num_layers, -1).astype(np.float64)):
        cosines = radial_cosines(sheets, layer).reshape(-1)
        weight = shows[layer].reshape(-1) + EMPTY_WEIGHT
        weights = (weight * np.maximum(cosines, MIN_COSINE) ** 2)[inside]
        values, wanted = _linear(shares, slides, below, radii[corners], radii[inside])
        matrix = csr_matrix((values.reshape(-1), columns, rows), shape=(len(corners), len(used)))
        normal = matrix.T @ diags(weights) @ matrix
        stay = diags(STAY * normal.diagonal() + 1e-6)
        right = matrix.T @ (weights * wanted) + stay @ (1 / radii[used])
        nearest, farthest = _around(columns, np.repeat(radii[inside], 3), radii[used])
        inverse = spsolve((normal + stay).tocsc(), right)
        fitted[layer] = 1 / inverse.clip(1 / (farthest * (1 + LOOSE)), 1 / (nearest * (1 - LOOSE)))
    result = sheets.radii.reshape(sheets.num_layers, -1).copy()
    result[:, used] = np.minimum.accumulate(fitted, 0)
    return Sheets(**{**vars(sheets), "radii": result.reshape(sheets.radii.shape)})


def _around(vertices: NDArray[np.int64], samples: Array, own: Array) -> tuple[Array, Array]:
    """Least and greatest radius (V,) of the samples (S,) that have a share of each vertex, and of its own (V,).

    Args:
        vertices: (S,) which vertex.
    """
    nearest, farthest = own.copy(), own.copy()
    np.minimum.at(nearest, vertices, samples)
    np.maximum.at(farthest, vertices, samples)
    return nearest, farthest


def _shares(
    sheets: Sheets, uv: Array, corners: NDArray[np.int64], inside: NDArray[np.bool_]
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Of samples in triangles with `corners` (S, 3): what their radii are of the corners'.

    Returns:
        shares (S, 3): a_k, below the belt b_k d_k . d; slides (S,): sum_k b_k (o_k - o) . d; and (S,) bool: below.
    """
    chart = sheets.chart
    below = np.asarray(chart.below(uv)[inside] | chart.below(uv)[corners].any(1))
    directions = np.asarray(chart.directions(uv))
    flat = np.concatenate([uv, np.ones((len(uv), 1))], 1)
    shares = np.empty(corners.shape)
    for which, vectors in ((~below, directions), (below, flat)):
        own, aims = vectors[corners[which]].transpose(0, 2, 1), vectors[inside][which][..., None]
        shares[which] = np.linalg.solve(own, aims)[..., 0]
    slides = np.zeros(len(corners))
    own, origins, along = corners[below], np.asarray(chart.origins(uv)), directions[inside][below][:, None]
    shifts = origins[own] - origins[inside][below][:, None]
    slides[below] = (shares[below] * (shifts * along).sum(-1)).sum(1)
    shares[below] *= (directions[own] * along).sum(-1)
    return shares, slides, below


def _linear(shares: Array, slides: Array, below: NDArray[np.bool_], around: Array, radii: Array) -> tuple[Array, Array]:
    """Factors (S, 3) of the corners' inverse radii and right sides (S,), in units of inverse radii.

    Args:
        shares, slides, below: of `_shares`.
        around: (S, 3) radii of the samples at the corners.
        radii: (S,) of the samples.
    """
    values = np.where(below[:, None], shares * (around / radii[:, None]) ** 2, shares)
    wanted = np.where(below, (2 * (shares * around).sum(1) + slides) / radii - 1, 1) / radii
    return values, wanted


def radial_cosines(sheets: Sheets, layer: int) -> Array:
    """(n, n) cosines between a layer's normals and its rays: 1 / sqrt(1 + |grad ln rho|^2) on the sphere.

    Below a belt a step in u is as long everywhere, and the rays' own slant is left out.
    """
    uv = vertex_uv(sheets).reshape(sheets.st.shape) * (math.pi / 2)
    radii, belt = sheets.radii[layer].astype(np.float64), sheets.chart.belt
    logarithm = np.log(radii)
    down = np.gradient(logarithm, uv[:, 0, 0], axis=0)
    lowest = -math.pi / 2 if belt is None else -belt.elevation
    right = np.gradient(logarithm, uv[0, :, 1], axis=1) / np.maximum(np.cos(np.maximum(uv[..., 0], lowest)), 1e-6)
    if belt is not None:
        down = np.where(uv[..., 0] < lowest, down * radii / belt.girth, down)
    return np.asarray(1 / np.sqrt(1 + down**2 + right**2))


@inlined
def _corners(faces, f, n, corners):  # type: ignore[no-untyped-def]
    """Writes rows and columns of a face's vertices in an n x n grid to corners (3, 2)."""
    for k in range(3):
        corners[k, 0], corners[k, 1] = faces[f, k] // n, faces[f, k] % n


@inlined
def _holds(corners, r, c):  # type: ignore[no-untyped-def]
    """Whether a triangle with corners (3, 2) in rows and columns holds the point (r, c), its border included."""
    e0 = (corners[1, 1] - corners[0, 1]) * (r - corners[0, 0]) - (corners[1, 0] - corners[0, 0]) * (c - corners[0, 1])
    e1 = (corners[2, 1] - corners[1, 1]) * (r - corners[1, 0]) - (corners[2, 0] - corners[1, 0]) * (c - corners[1, 1])
    e2 = (corners[0, 1] - corners[2, 1]) * (r - corners[2, 0]) - (corners[0, 0] - corners[2, 0]) * (c - corners[2, 1])
    return (e0 <= 0 and e1 <= 0 and e2 <= 0) or (e0 >= 0 and e1 >= 0 and e2 >= 0)


@kernel
def locate(faces, n):  # type: ignore[no-untyped-def]
    """(n, n): the last of the faces (F, 3) over an n x n grid's vertices that holds each vertex; -1 without any."""
    found = np.full((n, n), -1, np.int64)
    corners = np.empty((3, 2), np.int64)
    for f in range(faces.shape[0]):
        _corners(faces, f, n, corners)
        for r in range(corners[:, 0].min(), corners[:, 0].max() + 1):
            for c in range(corners[:, 1].min(), corners[:, 1].max() + 1):
                if _holds(corners, r, c):
                    found[r, c] = f
    return found
