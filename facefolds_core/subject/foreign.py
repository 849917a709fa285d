"""Gaussians that somebody else's program has fitted, brought into the scene, and looked at there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.quaternions import quaternion
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.spacing import spread
from facefolds_core.subject.drawing import render
from facefolds_core.subject.ply import read_ply
from facefolds_core.subject.splats import MEAN, SCALE, SHINE, TURN, Splats

LEAST = 15.0
"""PSNR over whole training pictures, dB, under which a file does not show what they show."""
LOOKED_AT = 5
"""Training pictures that are drawn to know."""


def moved(splats: Splats, similarity: Similarity) -> Splats:
    """The same Gaussians after the world was moved."""
    values = splats.values.copy()
    values[:, MEAN] = similarity.apply(splats.means.astype(np.float64))
    values[:, SCALE] += np.log(similarity.scale)
    values[:, TURN] = _product(quaternion(similarity.rotation), values[:, TURN].astype(np.float64))
    shine = values[:, SHINE].reshape(-1, 3, 3)
    values[:, SHINE] = np.einsum("ij,njq->niq", similarity.rotation, shine).reshape(-1, 9)
    return Splats(values, splats.background)


def _product(q: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternion (4,) times quaternions (N, 4), w first."""
    w, v, ws, vs = q[0], q[1:], others[:, :1], others[:, 1:]
    return np.concatenate([w * ws - vs @ v[:, None], w * vs + ws * v + np.cross(v, vs)], 1)


def read_start(path: str | Path, scene: Scene, frame: int = 0) -> Splats:
    """Gaussians of a file in the capture's coordinates, in the head's own frame in the scene.

    Raises:
        UserError: of `read_ply`; if they do not show what the training pictures of the frame show.
    """
    splats = moved(read_ply(path), scene.from_capture)
    if scene.poses is not None:
        splats = moved(splats, scene.poses.at(frame).inverse())
    store = scene.open_frames()
    there = spread([i for i in scene.indices("train") if (i, frame) in store], LOOKED_AT)
    found = list[float]()
    for index in there:
        rgb, _, _ = render(splats, scene.camera_in_head(index, frame))
        error = float(np.square(np.clip(rgb, 0, 1) - store.image(index, frame) / 255.0).mean())
        found.append(-10 * float(np.log10(max(error, 1e-10))))
    if np.median(found) < LEAST:
        raise UserError(
            "the Gaussians do not show what the pictures show",
            file=path,
            expected=f"PSNR of at least {LEAST:g} dB over training pictures",
            found=", ".join(f"{scene.cameras[i].name} {value:.1f}" for i, value in zip(there, found, strict=True)),
            remedy="export them in the coordinates of the capture's cameras (nerfstudio: without its own centring, "
            "scaling and turning), and of this frame",
        )
    return splats
