"""One head in the forms that bench/players.py compares: the asset with more triangles, Gaussian splats, a GLB."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.draco import encode_mesh
from facefolds_core.asset.manifest import MANIFEST_NAME, parse_manifest, write_manifest
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.params import MeshCodec
from facefolds_core.rendering.reference import sample_texture

EXACT = MeshCodec(quantization_bits=0, compression_level=0)
VISIBLE = 13 / 255
"""Splats of less opacity are not worth one."""
SPREAD = 0.6
"""Standard deviation of a splat over the mean distance of its neighbours: they close, and hardly blur."""
SPLAT = np.dtype([("centre", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rotation", "u1", 4)])
"""A record of a .splat file; rotation 128 + 128 w, x, y, z."""


def subdivided(mesh: TexturedMesh, times: int) -> TexturedMesh:
    """The same surface with each triangle cut into 4, `times` over."""
    vertices, faces, st = mesh.vertices, mesh.faces, mesh.st
    for _ in range(times):
        sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        edges, place = np.unique(sides, axis=0, return_inverse=True)
        ab, bc, ca = (len(vertices) + place.reshape(3, -1)).astype(np.int32)
        a, b, c = faces.T
        corners = ([a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca])
        faces = np.concatenate([np.stack(three, 1) for three in corners])
        vertices = np.concatenate([vertices, vertices[edges].mean(1, dtype=np.float32)])
        st = np.concatenate([st, st[edges].mean(1, dtype=np.float32)])
    return TexturedMesh(vertices, faces, st)


def write_single(folder: Path, level: AssetLevel, times: int) -> int:
    """An asset with this level alone, its meshes `subdivided`. Returns the number of its triangles."""
    folder.mkdir(parents=True)
    manifest = parse_manifest(level.folder / MANIFEST_NAME)
    for video in level.entry.texture.videos:
        shutil.copyfile(level.folder / video.file, folder / video.file)
    entries = []
    for entry, mesh in zip(level.entry.layers, level.layers, strict=True):
        data, stored = encode_mesh(subdivided(mesh, times), EXACT)
        (folder / entry.mesh).write_bytes(data)
        counts = {"vertices": len(stored.vertices), "triangles": len(stored.faces)}
        digest = hashlib.sha256(data).hexdigest()
        entries.append(entry.model_copy(update={**counts, "bytes": len(data), "sha256": digest}))
    size = sum(entry.bytes for entry in entries) + sum(video.bytes for video in level.entry.texture.videos)
    alone = level.entry.model_copy(update={"layers": tuple(entries), "bytes": size, "view_effects": None})
    update = {"levels": (alone,), "audio": None, "poster": None, "photos": ()}
    write_manifest(manifest.model_copy(update=update), folder / MANIFEST_NAME)
    return sum(entry.triangles for entry in entries)


def triangle_areas(mesh: TexturedMesh) -> NDArray[np.float64]:
    """(F,) areas."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    return np.asarray(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    )


def sample_splats(level: AssetLevel, count: int, seed: int = 0) -> NDArray[np.void]:
    """Gaussian splats of the level's first frame: points spread evenly over what is seen of all layers.

    Nothing is fitted: centre, colour and opacity are the layer's at that place, all have one isotropic size.

    Returns:
        (count,) records of SPLAT, in the asset's axes.
    """
    rng = np.random.default_rng(seed)
    areas = [triangle_areas(mesh) for mesh in level.layers]
    total = sum(float(area.sum()) for area in areas)
    found: list[tuple[NDArray[np.float64], NDArray[np.float32]]] = []
    drawn = kept = 0
    textures = level.frame(0)
    while kept < count:
        shares = rng.multinomial(2 * count, [area.sum() / total for area in areas])
        for mesh, texture, area, share in zip(level.layers, textures, areas, shares, strict=True):
            triangles = mesh.faces[rng.choice(len(area), share, p=area / area.sum())]
            weights = rng.dirichlet((1, 1, 1), share)
            st = np.einsum("nk,nkc->nc", weights, mesh.st[triangles]).astype(np.float32)
            rgba = sample_texture(texture, st)
            seen = rgba[:, 3] >= VISIBLE
            found.append((np.einsum("nk,nkc->nc", weights, mesh.vertices[triangles])[seen], rgba[seen]))
            kept += int(seen.sum())
        drawn += 2 * count
    centres, colours = (np.concatenate(parts) for parts in zip(*found, strict=True))
    spacing = np.sqrt(total * (kept / drawn) / count)
    pick = rng.permutation(kept)[:count]
    splats = np.zeros(count, SPLAT)
    splats["centre"], splats["scale"] = centres[pick], SPREAD * spacing
    splats["rgba"] = np.rint(255 * colours[pick])
    splats["rotation"] = (255, 128, 128, 128)
    return splats
