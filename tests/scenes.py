"""Tiny analytic scenes for tests: textured concentric spheres around the sphere centre c, seen by a few cameras.

Everything has a closed form: the first hit of a ray on a sphere, the colour there, the composite of two spheres.
Only the front half of a sphere (n_x > 0, the domain of the UV map) exists, as in the model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.found_scene import GAUSSIANS
from facefolds_core.captures.scene import SPHERE_CENTRE, Scene, Split, write_scene
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import directions_to_uv, uv_to_directions
from facefolds_core.subject.cameras import CameraFit
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, TURN, Splats
from facefolds_core.subject.storage import FoundSubject, write_found

Array = NDArray[np.float64]
CENTRE = np.array(SPHERE_CENTRE)


@dataclass(frozen=True)
class SphereLayer:
    """One textured sphere around c.

    Attributes:
        radius: units.
        alpha: its opacity, the same everywhere.
        waves: spatial frequency of its pattern, waves over v in [-1, 1].
    """

    radius: float
    alpha: float
    waves: float

    def colour(self, uv: Array, frame: int) -> Array:
        """(u, v) (..., 2) -> RGB (..., 3) in [0.1, 0.9]; the pattern drifts a little from frame to frame."""
        u, v = uv[..., 0] * math.pi * self.waves, uv[..., 1] * math.pi * self.waves
        phase = 0.4 * frame
        channels = [np.sin(v + phase), np.sin(u - v + 1 + phase), np.sin(u + 2)]
        return 0.5 + 0.4 * np.stack(channels, -1)


OPAQUE = (SphereLayer(0.33, 1.0, 4.0),)


def first_hit(origins: Array, directions: Array, radius: float) -> tuple[Array, NDArray[np.bool_]]:
    """Distance (...) to the near side of the sphere around c, and whether it is hit there with n_x > 0."""
    offset = origins - CENTRE
    b = (offset * directions).sum(-1)
    discriminant = b**2 - ((offset**2).sum(-1) - radius**2)
    distance = -b - np.sqrt(np.maximum(discriminant, 0))
    points = origins + distance[..., None] * directions
    return distance, (discriminant > 0) & (distance > 0) & (points[..., 0] > CENTRE[0])


def render(camera: Camera, layers: tuple[SphereLayer, ...], frame: int) -> tuple[Array, Array]:
    """Image of `layers` (outermost first) over black: RGB (H, W, 3) and opacity (H, W), at pixel centres."""
    origins, directions = camera.rays()
    rgb, transmittance = np.zeros((camera.height, camera.width, 3)), np.ones((camera.height, camera.width))
    for layer in layers:
        distance, hit = first_hit(origins, directions, layer.radius)
        points = origins + distance[..., None] * directions
        uv = directions_to_uv((points - CENTRE) / layer.radius)
        alpha = np.where(hit, layer.alpha, 0.0)
        rgb += (transmittance * alpha)[..., None] * layer.colour(uv, frame)
        transmittance = transmittance * (1 - alpha)
    return rgb, 1 - transmittance


def look_at_origin(name: str, azimuth: float, elevation: float, size: int, distance: float = 1.0) -> Camera:
    """A camera at `distance` from the origin, upright, looking at it; angles in degrees, field of view 39 degrees."""
    a, e = math.radians(azimuth), math.radians(elevation)
    centre = distance * np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    forward = -centre / distance
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    focal = size / 0.7
    K = np.array([[focal, 0, size / 2], [0, focal, size / 2], [0, 0, 1]])
    return Camera(name, K, np.concatenate([rotation, -(rotation @ centre)[:, None]], 1), size, size)


def view_of(camera: Camera) -> dict[str, Any]:
    """A camera as JSON has it."""
    size = {"width": camera.width, "height": camera.height}
    return {"K": camera.K.tolist(), "w2c": camera.w2c.tolist(), **size}


def _sphere_mesh(radius: float) -> tuple[Array, NDArray[np.int32]]:
    """Front half of a sphere around c: vertices (V, 3) and faces (F, 3)."""
    resolution = 24
    grid = np.linspace(-0.95, 0.95, resolution)
    uv = np.stack(np.meshgrid(grid, grid, indexing="ij"), -1).reshape(-1, 2)
    index = np.arange(resolution**2, dtype=np.int32).reshape(resolution, resolution)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel()
    return CENTRE + radius * uv_to_directions(uv), np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])


def cameras_alike(count: int) -> CameraFit:
    """Nothing is known of any of them."""
    return CameraFit(np.ones((count, 3)), np.full(count, np.nan))


def gaussians(layers: tuple[SphereLayer, ...], count: int = 3000) -> Splats:
    """Flat Gaussians, evenly spread over the front halves of the spheres."""
    rows = []
    for layer in layers:
        x = (np.arange(count) + 0.5) / count
        turn = math.pi * (3 - math.sqrt(5)) * np.arange(count)
        around = np.sqrt(1 - x**2)
        normals = np.stack([x, around * np.cos(turn), around * np.sin(turn)], -1)
        values = np.zeros((count, COLUMNS), np.float32)
        values[:, MEAN] = CENTRE + layer.radius * normals
        apart = layer.radius * math.sqrt(2 * math.pi / count)
        values[:, SCALE] = np.log([0.1 * apart, 0.7 * apart, 0.7 * apart])
        # The shortest axis, x, turned to the normal.
        values[:, TURN] = np.stack([1 + x, np.zeros(count), -normals[:, 2], normals[:, 1]], -1)
        values[:, OPACITY] = math.log(0.9 / 0.1) if layer.alpha == 1 else math.log(layer.alpha / (2 - layer.alpha))
        values[:, COLOUR] = layer.colour(directions_to_uv(normals), 0)
        rows.append(values)
    return Splats(np.concatenate(rows), np.zeros(3, np.float32))


def make_scene(
    folder: Path,
    layers: tuple[SphereLayer, ...] = OPAQUE,
    cameras: int = 7,
    size: int = 40,
    frames: int = 2,
    surface_radius: float | None = None,
    mattes: bool = False,
) -> Scene:
    """Write a scene of spheres as `normalize` would, with one held-out camera (the middle one) and its masks.

    Args:
        mattes: whether the true opacity of all training pictures is there, too, and the subject as Gaussians.
        surface_radius: writes a tracked mesh of this radius; None leaves it out.
    """
    folder.mkdir(parents=True, exist_ok=True)
    azimuths = np.linspace(-50, 50, cameras)
    rig = tuple(look_at_origin(f"cam{i}", a, 15 * (-1) ** i, size) for i, a in enumerate(azimuths))
    scene = Scene(
        subject="spheres",
        cameras=rig,
        splits=tuple("holdout" if i == cameras // 2 else "train" for i in range(cameras)),
        frame_ids=tuple(f"{k:06d}" for k in range(frames)),
        times=np.arange(frames) / 30.0,
        fps=30.0,
        from_capture=Similarity.identity(),
        left_out=(),
        folder=folder,
    )

    def images() -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
        for i, camera in enumerate(rig):
            for k in range(frames):
                yield i, k, np.round(render(camera, layers, k)[0] * 255).astype(np.uint8)

    def opacities(split: Split) -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
        for i in scene.indices(split):
            for k in range(frames):
                yield i, k, np.round(render(rig[i], layers, k)[1][..., None] * 255).astype(np.uint8)

    write_frames(folder / "frames.arrow", (size, size, 3), images())
    write_frames(folder / "masks.arrow", (size, size, 1), opacities("holdout"))
    if mattes:
        write_frames(folder / "mattes.arrow", (size, size, 1), opacities("train"))
        alike = cameras_alike(len(scene.indices("train")))
        found = FoundSubject(gaussians(layers), 20.0, alike)  # of one colour: they explain little
        write_found(folder / GAUSSIANS, found)
    if surface_radius is not None:
        vertices, faces = _sphere_mesh(surface_radius)
        stacked = np.repeat(vertices[None], frames, 0).astype(np.float32)
        np.savez(folder / "surface.npz", vertices=stacked, faces=faces)
    write_scene(scene, folder)
    return scene
