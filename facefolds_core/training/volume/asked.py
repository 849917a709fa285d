"""Whether a room with parallax shows cameras that its fit did not see better than a far sphere does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams
from facefolds_core.training.photos import posed_photos
from facefolds_core.training.volume.fit import VolumeFit, volume_frames
from facefolds_core.training.volume.optimise import rays_of


def room_gain(scene: Scene, params: ExplicitParams, bar: tqdm) -> float:
    """dB that the outer zone gains on training cameras that are left out of two fits of the coarse level.

    What few cameras see of a room, or badly calibrated ones, an outer zone explains to each of them by its own fog
    before the subject: on their own rays it always gains.

    Args:
        bar: advanced by one an iteration; its total grows.

    Returns:
        0 where it cannot be asked: of one or two cameras, or where those that are left see no place in common.
    """
    if len(scene.indices("train")) < 3:
        return 0.0
    try:
        return _gain(scene, params, bar)
    except UserError:
        return 0.0


def _gain(scene: Scene, params: ExplicitParams, bar: tqdm) -> float:
    out = left_out(scene, params.room.asked_cameras)
    part = replace(scene, splits=tuple("out" if i in out else split for i, split in enumerate(scene.splits)))
    views = posed_photos(scene, out, volume_frames(scene, params)[:1])
    found = []
    for outer in (False, True):
        fit = VolumeFit(part, params, outer)
        bar.total += params.volume.levels[0].iterations
        fit.run(0, bar)
        volume = fit.volume()
        rays = rays_of(views, volume.voxel, params.volume.pixel)
        rgb, alpha, _ = volume.render(rays.origins, rays.directions)
        behind, _ = rays.over(volume.room.look_up(rays.room_origins, rays.room_directions))
        shown = rgb + (1 - alpha[:, None]) * behind
        found.append(max(float(((shown - rays.colours) ** 2).mean()), 1e-12))
    return float(10 * np.log10(found[0] / found[1]))


def left_out(scene: Scene, share: int) -> list[int]:
    """One of so many training cameras, at least one and never all, spread by azimuth."""
    train = scene.indices("train")
    centres = [scene.cameras[i].centre for i in train]
    order = np.argsort([np.arctan2(centre[1], centre[0]) for centre in centres])
    count = min(max(1, len(train) // share), len(train) - 1)
    places = ((np.arange(count) + 0.5) * len(train) / count).astype(int)
    return sorted(train[order[place]] for place in places)
