"""Fit a volume to the training images of one frame, without masks, mesh or any other guess of where the subject is.

The box holds what enough cameras see near the scene's origin. It starts as fog, half opaque; behind it stands the
room (`room.py`). Where cameras disagree the fog clears, where they agree it thickens."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import ExplicitParams, VolumeParams
from facefolds_core.training.device import choose
from facefolds_core.training.photos import posed_photos
from facefolds_core.training.volume import kernel, look_kernel
from facefolds_core.training.volume.cameras import CameraFit
from facefolds_core.training.volume.optimise import Rays, clear, rays_of, train
from facefolds_core.training.volume.room import Room, room_type
from facefolds_core.training.volume.sight import seen_share

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Volume:
    """Density and colour on a grid.

    Attributes:
        grid: (X, Y, Z, 4) raw density and rgb; the optical depth of a voxel is softplus(raw).
        lower: (3,) position of voxel (0, 0, 0), units.
        voxel: its side, units.
        step: between samples on a ray, voxels.
        room: what is behind.
        frame: index of the frame that it was fitted to.
        psnr: on the training rays of the last iterations, dB.
        cameras: what single training cameras do differently.
        removed: what was in the grid beside the subject (`subject.py`), on the same grid; None where nothing is known.
    """

    grid: Array
    lower: NDArray[np.float64]
    voxel: float
    step: float
    room: Room
    frame: int
    psnr: float
    cameras: CameraFit
    removed: Array | None = None

    def denser(self, gain: float) -> Volume:
        """With the optical depths of the subject times `gain`."""
        depth = gain * np.logaddexp(0, self.grid[..., 0].astype(np.float64))
        grid = self.grid.copy()
        # The inverse of softplus, which is the identity for all that is opaque.
        grid[..., 0] = np.where(depth > 30, depth, np.log(np.expm1(np.clip(depth, 1e-12, 30))))
        return replace(self, grid=grid)

    def behind(self, origins: Array, directions: Array) -> Array:
        """Rays (R, 3) -> colours (R, 3) of what stands behind the subject: what was removed, and the room."""
        colours = self.room.look_up(origins, directions)
        if self.removed is None:
            return colours
        rgb, alpha, _ = replace(self, grid=self.removed).render(origins, directions)
        return (rgb + (1 - alpha[:, None]) * colours).astype(np.float32)

    def render(self, origins: Array, directions: Array) -> tuple[Array, Array, Array]:
        """Rays (R, 3) -> rgb over black (R, 3), alpha (R,), distance at which T falls to 1/2 or 0 (R,)."""
        rgb, alpha, depth = look_kernel.render(
            np.ascontiguousarray(origins, np.float32),
            np.ascontiguousarray(directions, np.float32),
            self.grid,
            self.lower,
            self.voxel,
            self.step * self.voxel,
        )
        return rgb, alpha, depth


def bounding_box(cameras: list[Camera], params: VolumeParams) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of what the ball of `reach` holds that `min_view_share` of the cameras sees.

    Raises:
        UserError: if there is no such place.
    """
    axis = np.linspace(-params.reach, params.reach, 37)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    points = points[np.linalg.norm(points, axis=1) <= params.reach]
    kept = points[seen_share(cameras, points) >= params.min_view_share]
    if len(kept) == 0:
        raise UserError(
            "the training cameras do not look at one place",
            expected=f"points within {params.reach} units of the subject's centre that {params.min_view_share:.0%} "
            "of the cameras see",
            found="none",
            remedy="check the capture's calibration, and `front` or the head poses",
        )
    half = 0.5 * (axis[1] - axis[0])
    return kept.min(0) - half, kept.max(0) + half


def volume_frames(scene: Scene, params: ExplicitParams) -> list[int]:
    """The frame that a volume is fitted to, and of a head that turns others, spread over the take."""
    if scene.poses is None:
        return [scene.num_frames // 2]
    spread = np.linspace(0, scene.num_frames - 1, params.moving.volume_frames - 1)
    return list(dict.fromkeys([scene.poses.nearest(), *(round(k) for k in spread)]))


class VolumeFit:
    """A fit to the middle frame, level by level; of a head that turns, to the frame nearest its mean pose and some
    others (`train.moving.volume_frames`): in each of them the cameras see it from elsewhere.

    Args:
        scene, params: of the training.
        outer: whether there is an outer zone with parallax (`room.py`), or the far sphere alone is behind.

    Attributes:
        psnr: on the training rays of the last iterations, dB.

    Raises:
        UserError: if the cameras do not look at one place.
    """

    def __init__(self, scene: Scene, params: ExplicitParams, outer: bool) -> None:
        indices = scene.indices("train")
        self.params, self.outer = params, outer
        self.frame = volume_frames(scene, params)[0]
        self.views = posed_photos(scene, indices, volume_frames(scene, params))
        self.cameras = [view.camera for view in self.views]
        self.lower, self.upper = bounding_box(self.cameras, params.volume)
        self.random = np.random.default_rng(params.seed)
        self.mean = np.mean([view.photo.image.mean((0, 1)) for view in self.views], 0) / 255
        farthest = max(float(np.linalg.norm(c.centre)) for c in self.cameras)
        self.gpu = choose(params.device).gpu
        self.room = room_type(self.gpu)(
            self.mean.astype(np.float32), farthest, params.volume.reach, params.room, params.environment
        )
        self.grid: Array | None = None
        self.voxel = self.psnr = 0.0
        self.found = CameraFit.alike(len(indices), params.cameras)
        self.rays: Rays | None = None

    def run(self, number: int, bar: tqdm) -> None:
        """One level; `bar` is advanced by one an iteration.

        Raises:
            UserError: if the numbers stop being finite.
        """
        wanted, level = self.params.volume, self.params.volume.levels[number]
        finer = float((self.upper - self.lower).max()) / (level.resolution - 1)
        shape = tuple(np.ceil((self.upper - self.lower) / finer - 1e-6).astype(int) + 1)
        share = _share(self.cameras, self.lower, finer, shape, wanted)
        coarser = self.grid
        grid = _fog(share, self.mean, wanted) if coarser is None else _resample(coarser, self.voxel, shape, finer)
        grid[share == 0, 0] = -kernel.LIMIT
        rays = rays_of(self.views, finer, wanted.pixel)
        corrected = self.found.corrected
        colours, plate = corrected(rays.colours, rays.camera), corrected(rays.plate, rays.camera)
        rays = replace(rays, colours=colours, plate=plate)
        last = number == len(wanted.levels) - 1
        if self.outer:
            self.room.refine(level.room)
        self.psnr = train(
            grid, share, self.lower, finer, rays, self.room, level, last, wanted, self.random, bar, self.gpu
        )
        rgb, alpha, _ = look_kernel.render(rays.origins, rays.directions, grid, self.lower, finer, wanted.step * finer)
        self.found = self.found.refined(rgb, alpha, rays.colours, rays.camera)
        self.grid, self.voxel, self.rays = grid, finer, rays

    def volume(self) -> Volume:
        """What was found so far; its grid is copied."""
        assert self.grid is not None
        step = self.params.volume.step
        return Volume(self.grid.copy(), self.lower, self.voxel, step, self.room, self.frame, self.psnr, self.found)

    def finish(self) -> Volume:
        """The volume without what nothing speaks for; the room without what no camera has seen."""
        assert self.grid is not None and self.rays is not None
        clear(self.grid, self.lower, self.voxel, self.rays, self.room, self.params.volume)
        rays = self.rays
        step = self.params.volume.step * self.voxel
        _, alpha, _ = look_kernel.render(rays.origins, rays.directions, self.grid, self.lower, self.voxel, step)
        self.room.forget_unseen(rays.room_origins, rays.room_directions, 1 - alpha)
        return self.volume()


def fit_volume(scene: Scene, params: ExplicitParams, bar: tqdm, outer: bool = False) -> Volume:
    """All levels, in the box that is asked for; see `VolumeFit`. `search.py` finds box and zones by itself."""
    fit = VolumeFit(scene, params, outer)
    for number in range(len(params.volume.levels)):
        fit.run(number, bar)
    return fit.finish()


def iterations(params: VolumeParams) -> int:
    """Of all levels."""
    return sum(level.iterations for level in params.levels)


def _fog(share: Array, colour: NDArray[np.float64], params: VolumeParams) -> Array:
    grid = np.empty((*share.shape, 4), np.float32)
    seen, shared = params.min_view_share, params.shared_view_share
    thick = np.clip((share - seen) / (shared - seen), params.empty_depth, 1)
    grid[..., 0] = np.log(np.expm1(params.fog / max(share.shape) * thick))
    grid[..., 1:] = colour
    return grid


def _resample(grid: Array, voxel: float, shape: tuple[int, ...], finer: float) -> Array:
    at = np.meshgrid(*(np.arange(n) * finer / voxel for n in shape), indexing="ij")
    return np.stack([ndimage.map_coordinates(grid[..., q], at, order=1, mode="nearest") for q in range(4)], -1)


def _share(
    cameras: list[Camera], lower: NDArray[np.float64], voxel: float, shape: tuple[int, ...], params: VolumeParams
) -> Array:
    """(X, Y, Z) share of the cameras that see each voxel; 0 below `min_view_share` or beyond `reach`."""
    axes = [lower[a] + voxel * np.arange(n) for a, n in enumerate(shape)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    share = seen_share(cameras, points)
    share[(share < params.min_view_share) | (np.linalg.norm(points, axis=1) > params.reach)] = 0
    return share.reshape(shape).astype(np.float32)
