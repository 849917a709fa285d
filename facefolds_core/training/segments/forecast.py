"""What a training will take, before it begins: how, how long, how much memory and disk; what cannot be is refused."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numba
import psutil

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.state import model_bytes
from facefolds_core.training.explicit.targets import KEPT_BYTES

TEXEL_BYTES = 300.0
"""A texel of one frame takes so many in a training at once."""

FLOOR_BYTES = 700e6
"""Memory that every training takes beside textures and rays."""

TEXELS_PER_PIXEL = 3.8
"""Texels that are reckoned with for a pixel of one picture, before they are known."""

RAY_SECONDS = 1500e-9
"""Of one core for a ray and step, by which the time is forecast."""

FOLLOWING = 6
"""Steps as long as which it takes, of a frame of a segment, to find and to follow what moves."""

PROCESS_SECONDS = 20.0
"""Of work on one core that are worth a process."""

FREE_SHARE = 0.9
"""Of the machine's memory that may be asked for; more is refused."""


@dataclass(frozen=True)
class Forecast:
    """Attributes:
    key_frames: of the base; None if the take is trained at once.
    memory, disk: bytes.
    seconds: on the cores that there are.
    """

    key_frames: int | None
    memory: int
    disk: int
    seconds: float

    def __str__(self) -> str:
        """In words, for the terminal."""
        how = "at once" if self.key_frames is None else f"in segments over {self.key_frames} key frames"
        minutes = self.seconds / 60
        time = f"{minutes:.0f} minutes" if minutes >= 2 else f"{self.seconds:.0f} s"
        return f"{how}: about {time}, {self.memory / 1e9:.1f} GB of memory, {self.disk / 1e9:.2f} GB on the disk"


def forecast(scene: Scene, params: ExplicitParams) -> Forecast:
    """Of a scene's training."""
    segments = params.segments
    side = params.textures.pixels_per_texel
    texels = round(TEXELS_PER_PIXEL * scene.width * scene.height / side**2)
    most = int(segments.memory_megabytes * 1e6 / (TEXEL_BYTES * texels))
    frames = scene.num_frames
    at_once = frames <= min(segments.joint_frames, most)
    keys = frames if at_once else min(max(1, most), frames, segments.key_frames)
    rays = len(scene.indices("train")) * scene.width * scene.height
    cut_outs = min(KEPT_BYTES, keys * 4 * rays)
    memory = round(keys * texels * TEXEL_BYTES + rays * _ray_bytes(params) + cut_outs + FLOOR_BYTES)
    steps = max(params.iterations, params.textures.steps_per_frame * keys)
    if not at_once:
        steps += (segments.steps + FOLLOWING) * frames
    seconds = _seconds(params, steps, texels) / numba.get_num_threads()
    base = model_bytes((1, texels), params.layers, keys)
    disk = base if at_once else base + 2 * texels * frames * (3 + params.layers)
    return Forecast(None if at_once else keys, memory, disk, seconds)


def processes_for(scene: Scene, params: ExplicitParams, texels: int, segments: int, frames: int) -> int:
    """How many processes are to fit the segments that are left.

    Args:
        texels: of the textures.
        segments, frames: that are left.
    """
    asked = params.segments.processes
    if asked:
        return min(asked, segments)
    available = FREE_SHARE * psutil.virtual_memory().available
    room = int(available / process_bytes(scene, params, texels))
    work = _seconds(params, frames * (params.segments.steps + FOLLOWING), texels)
    return max(1, min(numba.get_num_threads(), segments, room, int(work / PROCESS_SECONDS)))


def process_bytes(scene: Scene, params: ExplicitParams, texels: int) -> float:
    """Memory of one of the processes that fit segments; a still head's rays are the parent's, mapped."""
    rays = len(scene.indices("train")) * scene.width * scene.height
    moving = 0 if scene.poses is None else rays * _ray_bytes(params)
    cut_outs_and_pictures = rays * (4 + 3)
    return texels * _frame_bytes(params) + cut_outs_and_pictures + moving + FLOOR_BYTES


def _frame_bytes(params: ExplicitParams) -> int:
    """A texel while one frame is fitted: the shared values, the frame's with two moments, texture and gradient."""
    n = params.layers
    return 4 * (2 * (3 + 4 * n) + 3 * (3 + n) + 2 * 4 * n)


def _seconds(params: ExplicitParams, steps: int, texels: int) -> float:
    """Of one core."""
    rays = steps * texels * params.textures.rays_per_texel
    return rays * RAY_SECONDS * params.layers / 12


def _ray_bytes(params: ExplicitParams) -> int:
    """A ray that may meet the subject: codes, camera, pixel, direction; what is reflected, and the pictures of a frame
    while they are cut out."""
    return 4 * params.layers + 20 + 12 + 6


def check_forecast(found: Forecast, params: ExplicitParams, place: Path | None) -> None:
    """Refuse what cannot be.

    Args:
        place: where the model is to be written; None leaves the disk out.

    Raises:
        UserError: if memory or disk would not do.
    """
    total = psutil.virtual_memory().total
    if found.memory > FREE_SHARE * total:
        raise UserError(
            "this training does not fit into the memory of this machine",
            expected=f"{found.memory / 1e9:.1f} GB for it",
            found=f"{total / 1e9:.1f} GB, of which {FREE_SHARE:.0%} may be used",
            remedy="lower train.segments.memory_megabytes (fewer key frames) or normalize.long_side (smaller pictures)",
        )
    if place is not None:
        check_space(place, found.disk)


def check_space(folder: Path, needed: int) -> None:
    """Refuse to train what could not be written.

    Args:
        folder: of the model.
        needed: bytes.

    Raises:
        UserError: if there is less space on the disk.
    """
    there = next(path for path in folder.absolute().parents if path.exists())
    free = shutil.disk_usage(there).free
    if free < needed:
        raise UserError(
            "the trained model would not fit on the disk",
            file=folder,
            expected=f"{needed / 1e6:.0f} MB of free space",
            found=f"{free / 1e6:.0f} MB",
            remedy="free some space and run the same command again; finished stages are kept",
        )
