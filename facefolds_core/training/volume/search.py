"""The starting volume, with no more than the scene needs: an outer zone only where a far sphere does not explain what
is behind, a larger box only where the subject is cut off."""

from __future__ import annotations

import numpy as np
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume.fit import Volume, VolumeFit
from facefolds_core.training.volume.subject import body_at_centre, distances, positions, subject_of, without_room


def find_subject(scene: Scene, params: ExplicitParams, bar: tqdm) -> tuple[Volume, tuple[Fact, ...]]:
    """The volume of the middle frame with the subject alone in it, and what is to be said of how it was found.

    Args:
        bar: advanced by one an iteration; its total grows where the coarse level is run again.

    Raises:
        UserError: see `VolumeFit`.
    """
    coarse = params.volume.levels[0].iterations
    fit, notes = VolumeFit(scene, params, outer=False), list[Fact]()
    fit.run(0, bar)
    if fit.psnr < params.room.needed_below:
        notes.append(fact("room_fitted", psnr=fit.psnr, under=params.room.needed_below))
        reaches = [params.volume.reach, *params.subject.larger]
        for number, reach in enumerate(reaches):
            volume = params.volume.model_copy(update={"reach": reach})
            fit = VolumeFit(scene, params.model_copy(update={"volume": volume}), outer=True)
            bar.total += coarse
            fit.run(0, bar)
            share = cut_share(fit.volume(), params)
            if share < params.subject.max_cut:
                break
            more = number + 1 < len(reaches)
            then = "a larger one is taken" if more else "it may be cut off; see train.volume.reach"
            notes.append(fact("cut_by_the_ball", share=share, reach=reach, then=then))
    for number in range(1, len(params.volume.levels)):
        fit.run(number, bar)
    return subject_of(fit.finish(), params), tuple(notes)


def cut_share(volume: Volume, params: ExplicitParams) -> float:
    """Share of the subject's voxels that lie at the edge of the ball, neither behind nor below; 0 of nothing."""
    wanted = params.subject
    body = body_at_centre(volume, wanted.near, params.volume.body_depth)
    body = without_room(volume, body, wanted)
    distance, points, reach = distances(volume), positions(volume), volume.room.radius
    edge = body & (distance > reach - 2 * volume.voxel)
    edge &= (points[..., 0] >= wanted.behind) | (points[..., 2] > 0.5 * distance)
    edge &= points[..., 2] > -wanted.below * distance
    return int(np.count_nonzero(edge)) / max(1, int(np.count_nonzero(body)))
