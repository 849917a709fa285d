"""The starting volume, with no more than the scene needs: an outer zone only where a far sphere does not explain what
is behind, a larger box only where the subject is cut off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume.asked import room_gain
from facefolds_core.training.volume.fit import Volume, VolumeFit
from facefolds_core.training.volume.fog import clear_of_fog
from facefolds_core.training.volume.outline import visible_points
from facefolds_core.training.volume.subject import body_before, distances, positions, subject_of
from facefolds_core.training.volume.walls import Wall, find_walls


def find_subject(scene: Scene, params: ExplicitParams, bar: tqdm) -> tuple[Volume, tuple[Fact, ...]]:
    """The volume of the middle frame with the subject alone in it, and what is to be said of how it was found.

    Args:
        bar: advanced by one an iteration; its total grows where the coarse level is run again.

    Raises:
        UserError: see `VolumeFit`.
    """
    params = in_ball(scene.radius, params)
    plain, notes = VolumeFit(scene, params, outer=False), list[Fact]()
    plain.run(0, bar)
    # With mattes the room is known where the subject is not: an outer zone would take up the subject.
    cut_out = all(view.photo.matte is not None for view in plain.views)
    if plain.psnr < params.room.needed_below and not cut_out:
        gain, asked = room_gain(scene, params, bar), params.room
        about = {"psnr": plain.psnr, "under": asked.needed_below}
        if gain >= asked.least_gain:
            notes += [fact("room_fitted", **about), fact("room_gains", gain=gain)]
            found = clear_of_fog(_with_room(scene, params, bar, notes), params, notes)
            return found, tuple(notes)
        notes.append(fact("room_not_fitted", **about, gain=gain, least=asked.least_gain))
    for number in range(1, len(params.volume.levels)):
        plain.run(number, bar)
    return subject_of(plain.finish(), (), params), tuple(notes)


def in_ball(radius: float | None, params: ExplicitParams) -> ExplicitParams:
    """The parameters for a subject whose ball is given, units: no other is tried. None leaves them as they are."""
    if radius is None:
        return params
    volume = params.volume.model_copy(update={"reach": radius})
    return params.model_copy(update={"volume": volume, "subject": params.subject.model_copy(update={"larger": ()})})


def _with_room(scene: Scene, params: ExplicitParams, bar: tqdm, notes: list[Fact]) -> Volume:
    """The subject in a volume with an outer zone, in a ball that does not cut it off; `notes` grow."""
    reaches = [params.volume.reach, *params.subject.larger]
    for number, reach in enumerate(reaches):
        volume = params.volume.model_copy(update={"reach": reach})
        fit = VolumeFit(scene, params.model_copy(update={"volume": volume}), outer=True)
        bar.total += params.volume.levels[0].iterations
        fit.run(0, bar)
        coarser = fit.volume()
        share = cut_share(coarser, _walls(coarser, fit.cameras, params), params)
        if share < params.subject.max_cut:
            break
        more = number + 1 < len(reaches)
        then = "a larger one is taken" if more else "it may be cut off; see train.volume.reach"
        notes.append(fact("cut_by_the_ball", share=share, reach=reach, then=then))
    for number in range(1, len(params.volume.levels)):
        fit.run(number, bar)
    found = fit.finish()
    walls = _walls(found, fit.cameras, params)
    if walls:
        notes.append(fact("walls", count=len(walls), margin=params.subject.walls.margin))
    return subject_of(found, walls, params)


def _walls(volume: Volume, cameras: list[Camera], params: ExplicitParams) -> tuple[Wall, ...]:
    return find_walls(visible_points(volume, cameras), cameras, volume.voxel, params.subject.walls)


def cut_share(volume: Volume, walls: Sequence[Wall], params: ExplicitParams) -> float:
    """Share of the subject's voxels that lie at the edge of the ball, but not below; 0 of nothing."""
    body = body_before(volume, walls, params)
    distance, points, reach = distances(volume), positions(volume), volume.room.radius
    edge = body & (distance > reach - 2 * volume.voxel)
    edge &= points[..., 2] > -params.subject.below * distance
    return int(np.count_nonzero(edge)) / max(1, int(np.count_nonzero(body)))
