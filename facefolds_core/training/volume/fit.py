"""Fit a volume to the training images of one frame, without masks, mesh or any other guess of where the subject is.

The box holds what enough cameras see near the scene's origin. It starts as fog, half opaque; behind it stands the
room (`room.py`). Where cameras disagree the fog clears, where they agree it thickens."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.training.volume import kernel
from facefolds_core.training.volume.cameras import CameraFit
from facefolds_core.training.volume.room import Room

Array = NDArray[np.float32]

REACH = 0.45
"""The box lies within this distance of the origin, units: a head, hair, neck and the upper chest; cameras are about 1
away."""

SEEN = 0.1
"""Voxels that fewer of the training cameras see are empty: what only one camera sees can be anything."""

FOG = 2.0
"""Optical depth along the box at the start, where at least SHARED of the cameras see a voxel; it falls to nothing where
only SEEN of them do. What few cameras see must show that it is there: a dark room would stay as dark fog."""

SHARED = 0.35

VEIL, SOLID, SMOOTH = 0.001, 0.003, 0.001
"""Prices of opacity, of half opacity, and of differences between neighbours: see `kernel`."""

RATE_COLOUR = 0.03
RAYS = 16384
STEP = 0.7
"""Between samples, voxels."""

PIXEL = 0.7
"""Images are reduced until a pixel covers this many voxels at the origin."""

LEVELS = ((48, 120), (96, 120))
"""Voxels along the longest side, and iterations."""

ROOM = (48, 80)
"""Voxels a side of the outer zone, by level."""

EVIDENCE = 0.005
"""Squared colour distance, summed over channels, from what lies behind: a voxel whose rays are all nearer to it is
cleared. It explains nothing that the background does not, as a dark shell before a dark wall."""

EMPTY = 1e-3
"""Blocks whose voxels all have a smaller optical depth a voxel are skipped."""


@dataclass(frozen=True)
class Volume:
    """Density and colour on a grid.

    Attributes:
        grid: (X, Y, Z, 4) raw density and rgb; the optical depth of a voxel is softplus(raw).
        lower: (3,) position of voxel (0, 0, 0), units.
        voxel: its side, units.
        room: what is behind.
        frame: index of the frame that it was fitted to.
        psnr: on the training rays of the last iterations, dB.
        cameras: what single training cameras do differently.
    """

    grid: Array
    lower: NDArray[np.float64]
    voxel: float
    room: Room
    frame: int
    psnr: float
    cameras: CameraFit

    def render(self, origins: Array, directions: Array) -> tuple[Array, Array, Array]:
        """Rays (R, 3) -> rgb over black (R, 3), alpha (R,), distance at which T falls to 1/2 or 0 (R,)."""
        rgb, alpha, depth = kernel.render(
            np.ascontiguousarray(origins, np.float32),
            np.ascontiguousarray(directions, np.float32),
            self.grid,
            self.lower,
            self.voxel,
            STEP * self.voxel,
        )
        return rgb, alpha, depth


@dataclass(frozen=True)
class _Rays:
    origins: Array
    directions: Array
    colours: Array
    camera: NDArray[np.int32]


def seen_share(cameras: list[Camera], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P,) share of the cameras in whose images points (P, 3) lie."""
    count = np.zeros(len(points))
    for camera in cameras:
        at = (points @ camera.rotation.T + camera.w2c[:, 3]) @ camera.K.T
        pixel = at[:, :2] / np.maximum(at[:, 2:], 1e-9)
        inside = (pixel >= 0).all(1) & (pixel[:, 0] < camera.width) & (pixel[:, 1] < camera.height)
        count += inside & (at[:, 2] > 0)
    return count / len(cameras)


def bounding_box(cameras: list[Camera]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of what the ball of REACH holds that SEEN of the cameras see.

    Raises:
        UserError: if there is no such place.
    """
    axis = np.linspace(-REACH, REACH, 37)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    points = points[np.linalg.norm(points, axis=1) <= REACH]
    kept = points[seen_share(cameras, points) >= SEEN]
    if len(kept) == 0:
        raise UserError(
            "the training cameras do not look at one place",
            expected=f"points within {REACH} units of the subject's centre that {SEEN:.0%} of the cameras see",
            found="none",
            remedy="check the capture's calibration, and `front` or the head poses",
        )
    half = 0.5 * (axis[1] - axis[0])
    return kept.min(0) - half, kept.max(0) + half


def fit_volume(scene: Scene, seed: int, rate: float, bar: tqdm) -> Volume:
    """Fit to the middle frame.

    Args:
        rate: learning rate of raw density.
        bar: advanced by one an iteration, `iterations()` in all.

    Raises:
        UserError: if the cameras do not look at one place, or the numbers stop being finite.
    """
    indices = scene.indices("train")
    cameras = [scene.cameras[i] for i in indices]
    frame = scene.num_frames // 2
    store = scene.open_frames()
    images = [store.image(i, frame) for i in indices]
    lower, upper = bounding_box(cameras)
    random = np.random.default_rng(seed)
    mean = np.mean([image.mean((0, 1)) for image in images], 0) / 255
    reach = max(float(np.linalg.norm(c.centre)) for c in cameras)
    room = Room(mean.astype(np.float32), reach, REACH, ROOM[0])
    grid, voxel, psnr = None, 0.0, 0.0
    found = CameraFit.alike(len(cameras))
    for number, (resolution, iterations) in enumerate(LEVELS):
        finer = float((upper - lower).max()) / (resolution - 1)
        shape = tuple(np.ceil((upper - lower) / finer - 1e-6).astype(int) + 1)
        share = _share(cameras, lower, finer, shape)
        grid = _fog(share, mean) if grid is None else _resample(grid, voxel, shape, finer)
        voxel = finer
        grid[share == 0, 0] = -kernel.LIMIT
        rays = _rays(cameras, images, voxel)
        rays = replace(rays, colours=found.corrected(rays.colours, rays.camera))
        last = number == len(LEVELS) - 1
        if number > 0:
            room.refine(ROOM[number])
        psnr = _train(grid, share, lower, voxel, rays, room, iterations, last, rate, random, bar)
        rgb, alpha, _ = kernel.render(rays.origins, rays.directions, grid, lower, voxel, STEP * voxel)
        found = found.refined(rgb, alpha, rays.colours, rays.camera)
    assert grid is not None
    _clear(grid, lower, voxel, rays, room)
    return Volume(grid, lower, voxel, room, frame, psnr, found)


def iterations() -> int:
    return sum(count for _, count in LEVELS)


def _fog(share: Array, colour: NDArray[np.float64]) -> Array:
    grid = np.empty((*share.shape, 4), np.float32)
    thick = np.clip((share - SEEN) / (SHARED - SEEN), EMPTY, 1)
    grid[..., 0] = np.log(np.expm1(FOG / max(share.shape) * thick))
    grid[..., 1:] = colour
    return grid


def _resample(grid: Array, voxel: float, shape: tuple[int, ...], finer: float) -> Array:
    at = np.meshgrid(*(np.arange(n) * finer / voxel for n in shape), indexing="ij")
    return np.stack([ndimage.map_coordinates(grid[..., q], at, order=1, mode="nearest") for q in range(4)], -1)


def _share(cameras: list[Camera], lower: NDArray[np.float64], voxel: float, shape: tuple[int, ...]) -> Array:
    """(X, Y, Z) share of the cameras that see each voxel; 0 where it is below SEEN or beyond REACH."""
    axes = [lower[a] + voxel * np.arange(n) for a, n in enumerate(shape)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    share = seen_share(cameras, points)
    share[(share < SEEN) | (np.linalg.norm(points, axis=1) > REACH)] = 0
    return share.reshape(shape).astype(np.float32)


def _rays(cameras: list[Camera], images: list[NDArray[np.uint8]], voxel: float) -> _Rays:
    """One ray for each pixel of the reduced images."""
    pixel = float(np.median([np.linalg.norm(c.centre) / c.K[0, 0] for c in cameras]))
    factor = max(1, round(PIXEL * voxel / pixel))
    origins, directions, colours, numbers = [], [], [], []
    for number, (camera, image) in enumerate(zip(cameras, images, strict=True)):
        height, width = max(1, camera.height // factor), max(1, camera.width // factor)
        x, y = np.meshgrid((np.arange(width) + 0.5) * factor, (np.arange(height) + 0.5) * factor)
        origin, direction = camera.rays(np.stack([x, y], -1).reshape(-1, 2))
        origins.append(np.broadcast_to(origin, direction.shape).astype(np.float32))
        directions.append(direction.astype(np.float32))
        part = np.ascontiguousarray(image[: height * factor, : width * factor])
        small = cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA)
        colours.append(small.reshape(-1, 3).astype(np.float32) / 255)
        numbers.append(np.full(width * height, number, np.int32))
    return _Rays(np.concatenate(origins), np.concatenate(directions), np.concatenate(colours), np.concatenate(numbers))


def _occupied(density: Array) -> NDArray[np.bool_]:
    """Blocks that hold, or touch, a voxel that is not empty."""
    block = kernel.BLOCK
    blocks = tuple(n // block + 1 for n in density.shape)
    padded = np.full([block * n for n in blocks], -kernel.LIMIT, np.float32)
    padded[tuple(slice(n) for n in density.shape)] = ndimage.maximum_filter(density, 3)
    split = padded.reshape(blocks[0], block, blocks[1], block, blocks[2], block)
    occupied: NDArray[np.bool_] = split.max((1, 3, 5)) > math.log(math.expm1(EMPTY))
    return occupied


def _shade(
    grid: Array,
    occupied: NDArray[np.bool_],
    lower: NDArray[np.float64],
    voxel: float,
    rays: _Rays,
    jitter: Array,
    background: Array,
    gradient: Array,
    veil: float,
    solid: float,
) -> tuple[float, Array, Array]:
    """`kernel.shade` with steps of STEP voxels: sum of |C - I|^2, residuals (R, 3), transmittance (R,)."""
    residual, through = np.empty_like(rays.colours), np.empty(len(rays.colours), np.float32)
    samples = int(math.sqrt(3) * max(grid.shape) / STEP) + 2
    squares: float = kernel.shade(
        rays.origins,
        rays.directions,
        jitter,
        rays.colours,
        background,
        grid,
        occupied,
        lower,
        voxel,
        STEP * voxel,
        samples,
        gradient,
        residual,
        through,
        veil,
        solid,
    )
    return squares, residual, through


def _clear(grid: Array, lower: NDArray[np.float64], voxel: float, rays: _Rays, room: Room) -> None:
    """Empty the voxels for which EVIDENCE is missing, in place: the mean over rays, by their weights there, of how far
    what they see in the volume is from the room behind it. What no ray reaches stays."""
    gradient = np.zeros((kernel.PARTS, *grid.shape), np.float32)
    background = room.look_up(rays.origins, rays.directions)
    rgb, alpha, _ = kernel.render(rays.origins, rays.directions, grid, lower, voxel, STEP * voxel)
    contrast = rgb / np.maximum(alpha, 0.1)[:, None] - background
    # The kernel splats its residuals C - I: with this target they are (squared contrast, 1, 0).
    wanted = np.zeros_like(rgb)
    wanted[:, 0], wanted[:, 1] = (contrast**2).sum(1), 1
    target = rgb + (1 - alpha)[:, None] * background - wanted
    occupied = np.ones(tuple(n // kernel.BLOCK + 1 for n in grid.shape[:3]), bool)
    half = np.full(len(rgb), 0.5, np.float32)
    seen = replace(rays, colours=target)
    _shade(grid, occupied, lower, voxel, seen, half, background, gradient, 0.0, 0.0)
    total = gradient.sum(0)
    weight = ndimage.gaussian_filter(total[..., 2], 1.0)
    evidence = ndimage.gaussian_filter(total[..., 1], 1.0) / np.maximum(weight, 1e-12)
    grid[(weight > 1e-6) & (evidence < EVIDENCE), 0] = -kernel.LIMIT


def _train(
    values: Array,
    share: Array,
    lower: NDArray[np.float64],
    voxel: float,
    rays: _Rays,
    room: Room,
    iterations: int,
    last: bool,
    rate: float,
    random: np.random.Generator,
    bar: tqdm,
) -> float:
    """Adam on `values`, in place; returns PSNR on the rays of the last iterations."""
    grid = np.stack([values, np.zeros_like(values), np.zeros_like(values)])
    gradient = np.zeros((kernel.PARTS, *values.shape), np.float32)
    count = min(RAYS, len(rays.origins))
    recent = math.nan
    for i in range(iterations):
        if i % 25 == 0:
            occupied = _occupied(grid[0, ..., 0])
        chosen = np.sort(random.choice(len(rays.origins), count, replace=False))
        origins, directions = rays.origins[chosen], rays.directions[chosen]
        part = _Rays(origins, directions, rays.colours[chosen], rays.camera[chosen])
        jitter = random.random(count, np.float32)
        behind = room.look(origins, directions, jitter)
        squares, residual, through = _shade(
            grid[0], occupied, lower, voxel, part, jitter, behind.colours, gradient, VEIL, SOLID
        )
        if not math.isfinite(squares):
            raise UserError("the fit of the starting volume diverged", remedy="check the capture's calibration")
        scale = 1 - 0.9 * i / iterations if last else 1.0
        room.step(behind, through[:, None] * residual, scale, rate)
        bias1, bias2 = 1 / (1 - kernel.BETA1 ** (i + 1)), 1 / (1 - kernel.BETA2 ** (i + 1))
        kernel.adam_step(grid, gradient, share, scale * rate, scale * RATE_COLOUR, bias1, bias2, SMOOTH)
        error = squares / (3 * count)
        recent = error if i == 0 else 0.9 * recent + 0.1 * error
        bar.update()
        bar.set_postfix(volume=f"{max(values.shape)}^3", psnr=f"{_psnr(recent):.2f}", refresh=False)
    values[:] = grid[0]
    return _psnr(recent)


def _psnr(error: float) -> float:
    """dB, of a mean squared error that may be 0."""
    return -10 * math.log10(max(error, 1e-12))
