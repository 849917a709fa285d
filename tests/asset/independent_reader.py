"""A player written from docs/reference/asset-format.md alone: nothing of facefolds is imported. Slow and plain.

Libraries: DracoPy for the meshes, PyAV for the video's planes, Pillow for the PNG. Everything else is the document's
formulas: YCbCr to RGB with centred chroma, rectangles, clamped bilinear look-ups, nearest hits, blending.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import av
import DracoPy
import numpy as np
from PIL import Image

Array = np.ndarray


class Player:
    """One level of an asset.

    Args:
        folder: of the asset.
        level: index in `levels`; the last is the full one.
    """

    def __init__(self, folder: Path, level: int = -1) -> None:
        manifest = json.loads((folder / "manifest.json").read_text())
        assert manifest["format"] == "facefolds" and manifest["version"] == 4
        self.folder, self.level = folder, manifest["levels"][level]
        files = {x["file"]: (folder / x["file"]).read_bytes() for x in self.level["meshes"]}
        parts = [files[x["mesh"]][x["offset"] : x["offset"] + x["bytes"]] for x in self.level["layers"]]
        self.meshes = [DracoPy.decode(part) for part in parts]
        self.reflection = self._reflection()

    def pictures(self) -> list[Array]:
        """All frames as (H, W, 3) RGB above and alpha in a fourth channel: (H, W, 4) of the picture's colour half."""
        video = self.level["texture"]["videos"][0]
        with av.open(str(self.folder / video["file"])) as container:
            return [self._rgba(frame.to_ndarray().astype(float)) for frame in container.decode(video=0)]

    def look(self, K: Array, w2c: Array, pixels: Array) -> tuple[Array, list[tuple[Array, Array]]]:
        """Rays (M, 3) through pixel centres (M, 2) = (x, y) of a camera, and where they hit each layer."""
        rotation, translation = w2c[:, :3], w2c[:, 3]
        eye = -rotation.T @ translation
        rays = np.concatenate([pixels, np.ones((len(pixels), 1))], 1) @ np.linalg.inv(K).T @ rotation
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        meshes = ((np.asarray(m.points, float), np.asarray(m.faces), np.asarray(m.tex_coord)) for m in self.meshes)
        return rays, [nearest(eye, rays, *mesh) for mesh in meshes]

    def render(self, picture: Array, view: tuple[Array, list[tuple[Array, Array]]], reflection: bool = False) -> Array:
        """Colours (M, 3) over black of one of `pictures`, along the rays of `look`."""
        rays, hits = view
        colour, through = np.zeros((len(rays), 3)), np.ones(len(rays))
        for layer, (hit, st) in zip(self.level["layers"], hits, strict=True):
            x, y, w, h = layer["texture_rect"]
            rgba = bilinear(picture[y : y + h, x : x + w], st)
            rgb = rgba[:, :3]
            if reflection and self.reflection is not None:
                rgb = np.clip(rgb + self._reflected(st, layer["uv_window"], rays[hit]), 0, 1)
            colour[hit] += (through[hit] * rgba[:, 3])[:, None] * rgb
            through[hit] *= 1 - rgba[:, 3]
        return colour

    def _rgba(self, planes: Array) -> Array:
        texture = self.level["texture"]
        height, width = texture["height"], texture["width"]
        luma = planes[:height]
        cb, cr = (upsampled(plane) for plane in planes[height:].reshape(2, height // 2, width // 2))
        y, b, r = (luma - 16) / 219, (cb - 128) / 224, (cr - 128) / 224
        red, blue = y + 1.5748 * r, y + 1.8556 * b
        green = (y - 0.2126 * red - 0.0722 * blue) / 0.7152
        cx, cy, w, h = texture["colour_rect"]
        ax, ay, _, _ = texture["alpha_rect"]
        colour = np.stack([red, green, blue], -1)[cy : cy + h, cx : cx + w]
        alpha = y[ay : ay + h, ax : ax + w, None]
        return np.clip(np.concatenate([colour, alpha], -1), 0, 1)

    def _reflection(self) -> dict[str, Array] | None:
        """Environment E, gloss g, offset m and normals n, in units of colour and length."""
        entry: dict[str, Any] | None = self.level.get("reflection")
        if entry is None:
            return None
        codes = np.asarray(Image.open(self.folder / entry["file"]), float)
        parts = {}
        for name in ("environment", "gloss", "offset", "normals"):
            x, y, w, h = entry[f"{name}_rect"]
            parts[name] = codes[y : y + h, x : x + w]
        signed = {name: parts[name] / 127.5 - 1 for name in ("offset", "normals")}
        return {
            "environment": entry["environment_scale"] * parts["environment"] / 255,
            "gloss": entry["gloss_scale"] * parts["gloss"] / 255,
            "offset": entry["offset_scale"] * signed["offset"],
            "normals": signed["normals"],
        }

    def _reflected(self, st: Array, window: list[float], d: Array) -> Array:
        """What is added (M, 3) at (s, t) of a layer with a window, along the rays d."""
        assert self.reflection is not None
        (a0, a1, b0, b1), (u0, u1, v0, v1) = window, self.level["reflection"]["uv_window"]
        s, t = st.T
        at = np.stack([(b0 - v0 + s * (b1 - b0)) / (v1 - v0), (u1 - a1 + t * (a1 - a0)) / (u1 - u0)], -1)
        n = bilinear(self.reflection["normals"], at)
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        r = d - 2 * np.minimum((d * n).sum(1), 0)[:, None] * n
        long = np.sqrt(np.maximum(2 * (1 + r[:, 0]), 1e-6))
        where = np.stack([0.5 + 0.5 * r[:, 1] / long, 0.5 - 0.5 * r[:, 2] / long], -1)
        light = bilinear(self.reflection["environment"], where)
        return bilinear(self.reflection["gloss"], at) * light - bilinear(self.reflection["offset"], at)


def upsampled(chroma: Array) -> Array:
    """Chroma at luma's pixels: (i, j) lies at row 2i + 0.5, column 2j + 0.5; linear between, repeated outside."""
    h, w = chroma.shape
    rows, columns = (np.clip((np.arange(2 * size) - 0.5) / 2, 0, size - 1) for size in (h, w))
    i, j = np.minimum(rows.astype(int), h - 2), np.minimum(columns.astype(int), w - 2)
    a, b = (rows - i)[:, None], (columns - j)[None]
    upper, lower = chroma[i], chroma[i + 1]
    return (1 - a) * ((1 - b) * upper[:, j] + b * upper[:, j + 1]) + a * ((1 - b) * lower[:, j] + b * lower[:, j + 1])


def bilinear(image: Array, st: Array) -> Array:
    """Look-ups in a rectangle (h, w, C) at (s, t) (M, 2), clamped to half a texel from its border."""
    h, w = image.shape[:2]
    x = np.clip(st[:, 0], 0.5 / w, 1 - 0.5 / w) * w - 0.5
    y = np.clip(st[:, 1], 0.5 / h, 1 - 0.5 / h) * h - 0.5
    j, i = np.clip(np.floor(x).astype(int), 0, w - 1), np.clip(np.floor(y).astype(int), 0, h - 1)
    j1, i1 = np.minimum(j + 1, w - 1), np.minimum(i + 1, h - 1)
    a, b = (y - i)[:, None], (x - j)[:, None]
    return (1 - a) * ((1 - b) * image[i, j] + b * image[i, j1]) + a * ((1 - b) * image[i1, j] + b * image[i1, j1])


def nearest(eye: Array, rays: Array, points: Array, faces: Array, st: Array) -> tuple[Array, Array]:
    """Indices of the rays (M, 3) that hit the mesh, and (s, t) there: every triangle is tried."""
    p, q, r = (points[faces[:, corner]] for corner in range(3))
    best, texture = np.full(len(rays), np.inf), np.zeros((len(rays), 2))
    step = max(1, 2_000_000 // len(faces))
    for first in range(0, len(rays), step):
        d = rays[first : first + step, None]
        # p + u (q - p) + v (r - p) = eye + z d, by Cramer's rule
        e, f, o = q - p, r - p, eye - p
        n = np.cross(d, f)
        det = (e * n).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (o * n).sum(-1) / det
            m = np.cross(o, e)
            v = (d * m).sum(-1) / det
            z = (f * m).sum(-1) / det
        z = np.where((u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (z > 0), z, np.inf)
        chosen = z.argmin(1)
        row = np.arange(len(chosen))
        best[first : first + step] = z[row, chosen]
        a, b, c = (st[faces[chosen, corner]] for corner in range(3))
        weights = np.stack([1 - u[row, chosen] - v[row, chosen], u[row, chosen], v[row, chosen]], -1)
        with np.errstate(invalid="ignore"):
            texture[first : first + step] = (weights[..., None] * np.stack([a, b, c], 1)).sum(1)
    hit = np.flatnonzero(np.isfinite(best))
    return hit, texture[hit]
