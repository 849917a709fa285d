"""The steps of the volume's fit: rays of the reduced images, Adam on the grid, and clearing what nothing speaks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from tqdm import tqdm

from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import VolumeLevel, VolumeParams
from facefolds_core.training.adam import corrections
from facefolds_core.training.photos import PosedPhoto
from facefolds_core.training.volume import kernel, look_kernel
from facefolds_core.training.volume.room import Room
from facefolds_core.training.volume.steps import shade, steps_type

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Rays:
    """R rays: origins, directions and colours (R, 3), numbers of their cameras (R,), and what is known beside.

    Attributes:
        room_origins, room_directions: (R, 3) the same rays in the room's frame: a head may turn in it.
        plate: (R, 3) what is behind the subject, NaN where it is not known. Where a matte says that there is no
            subject, it is what the ray shows.
        matte: (R,) opacity of the subject, -1 where it is not known.
    """

    origins: Array
    directions: Array
    room_origins: Array
    room_directions: Array
    colours: Array
    camera: NDArray[np.int32]
    plate: Array
    matte: Array

    def choose(self, which: NDArray[np.int64]) -> Rays:
        return Rays(**{field.name: getattr(self, field.name)[which] for field in fields(self)})

    def over(self, behind: Array) -> tuple[Array, NDArray[np.bool_]]:
        """What is behind (R, 3): the plates, `behind` where there is none; and where that is (R,)."""
        unknown = np.isnan(self.plate[:, 0])
        return np.where(unknown[:, None], behind, self.plate).astype(np.float32), unknown


def rays_of(views: Sequence[PosedPhoto], voxel: float, reduced: float) -> Rays:
    """One ray for each pixel of the photos, reduced until one covers so many voxels."""
    cameras = [view.camera for view in views]
    pixel = float(np.median([np.linalg.norm(c.centre) / c.K[0, 0] for c in cameras]))
    factor = max(1, round(reduced * voxel / pixel))
    parts = list[Rays]()
    for view in views:
        camera, photo = view.camera, view.photo
        height, width = max(1, camera.height // factor), max(1, camera.width // factor)
        x, y = np.meshgrid((np.arange(width) + 0.5) * factor, (np.arange(height) + 0.5) * factor)
        pixels = np.stack([x, y], -1).reshape(-1, 2)
        origins, directions = _rays(camera, pixels)
        room_origins, room_directions = _rays(view.in_room, pixels)

        def small(image: NDArray[np.uint8] | None, height: int = height, width: int = width) -> Array | None:
            if image is None:
                return None
            part = np.ascontiguousarray(image[: height * factor, : width * factor])
            mean = cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA)
            return (mean.reshape(width * height, -1) / np.float32(255)).astype(np.float32)

        colours, plate, matte = small(photo.image), small(photo.plate), small(photo.matte)
        assert colours is not None
        if matte is not None:
            plate = np.full_like(colours, np.nan) if plate is None else plate
            plate = np.where(np.isnan(plate) & (matte == 0), colours, plate)
        parts.append(
            Rays(
                origins=origins,
                directions=directions,
                room_origins=room_origins,
                room_directions=room_directions,
                colours=colours,
                camera=np.full(len(colours), view.number, np.int32),
                plate=np.full_like(colours, np.nan) if plate is None else plate,
                matte=np.full(len(colours), -1, np.float32) if matte is None else matte[:, 0],
            )
        )
    return Rays(**{field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Rays)})


def _rays(camera: Camera, pixels: NDArray[np.float64]) -> tuple[Array, Array]:
    origins, directions = camera.rays(pixels)
    return np.broadcast_to(origins, directions.shape).astype(np.float32), directions.astype(np.float32)


def clear(
    grid: Array,
    lower: NDArray[np.float64],
    voxel: float,
    rays: Rays,
    room: Room,
    params: VolumeParams,
) -> None:
    """Empty the voxels without `min_contrast`, in place: the mean over rays, by their weights there, of how far what
    they see in the volume is from the room behind it. What no ray reaches stays."""
    gradient, touched = kernel.empty_gradient(grid.shape)
    background, _ = rays.over(room.look_up(rays.room_origins, rays.room_directions))
    rgb, alpha, _ = look_kernel.render(rays.origins, rays.directions, grid, lower, voxel, params.step * voxel)
    contrast = rgb / np.maximum(alpha, 0.1)[:, None] - background
    # The kernel splats its residuals C - I: with this target they are (squared contrast, 1, 0).
    wanted = np.zeros_like(rgb)
    wanted[:, 0], wanted[:, 1] = (contrast**2).sum(1), 1
    target = rgb + (1 - alpha)[:, None] * background - wanted
    occupied = np.ones(tuple(n // kernel.BLOCK + 1 for n in grid.shape[:3]), bool)
    half = np.full(len(rgb), 0.5, np.float32)
    seen = replace(rays, colours=target)
    shade(grid, occupied, lower, voxel, seen, half, background, gradient, touched, params.step, 0.0, 0.0, 0.0)
    total = gradient.sum(0)
    weight = ndimage.gaussian_filter(total[..., 2], 1.0)
    evidence = ndimage.gaussian_filter(total[..., 1], 1.0) / np.maximum(weight, 1e-12)
    grid[(weight > 1e-6) & (evidence < params.min_contrast), 0] = -kernel.LIMIT


def train(
    values: Array,
    share: Array,
    lower: NDArray[np.float64],
    voxel: float,
    rays: Rays,
    room: Room,
    level: VolumeLevel,
    last: bool,
    params: VolumeParams,
    random: np.random.Generator,
    bar: tqdm,
    gpu: bool = False,
) -> float:
    """Adam on `values`, in place; returns PSNR on the rays of the last iterations."""
    steps = steps_type(gpu)(values, share, lower, voxel, params)
    count = min(params.rays, len(rays.origins))
    recent = math.nan
    for i in range(level.iterations):
        if i % 25 == 0:
            steps.occupy()
        chosen = np.sort(random.choice(len(rays.origins), count, replace=False))
        part = rays.choose(chosen)
        jitter = random.random(count, np.float32)
        behind = room.look(part.room_origins, part.room_directions, jitter)
        background, unknown = part.over(behind.colours)
        squares, residual, transmittance = steps.shade(part, jitter, background)
        if not math.isfinite(squares):
            raise UserError("the fit of the starting volume diverged", remedy="check the capture's calibration")
        scale = 1 - (1 - params.final_rate) * i / level.iterations if last else 1.0
        bias = corrections(params.betas, i + 1)
        rates = scale * params.learning_rate, scale * params.colour_learning_rate
        room.step(behind, (transmittance * unknown)[:, None] * residual, scale, *rates)
        steps.move(*rates, *bias)
        error = squares / (3 * count)
        recent = error if i == 0 else 0.9 * recent + 0.1 * error
        bar.update()
        bar.set_postfix(volume=f"{max(values.shape)}^3", psnr=f"{_psnr(recent):.2f}", refresh=False)
    values[:] = steps.values()
    return _psnr(recent)


def _psnr(error: float) -> float:
    """dB, of a mean squared error that may be 0."""
    return -10 * math.log10(max(error, 1e-12))
