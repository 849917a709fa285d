"""Which frames a training fits at once; of this the stage `matte`, too, must know, and of no model."""

from __future__ import annotations

from collections.abc import Sequence

from facefolds_core.captures.part import part_of
from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.training.segments.forecast import forecast
from facefolds_core.training.segments.keys import Float, comparable, farthest_first, likenesses, named_frames


def trained_at_once(scene: Scene, params: ExplicitParams) -> tuple[Scene, list[int]]:
    """What the starting volume and the layers are fitted to, and the numbers of its frames in the scene: all of it, or
    the key frames of a take that is trained in segments.

    Raises:
        UserError: as `plan.plan_take`.
    """
    count = forecast(scene, params).key_frames
    if count is None:
        return scene, list(range(scene.num_frames))
    keys = chosen_key_frames(scene, likenesses(scene), params, count)
    return part_of(scene, keys), keys


def chosen_key_frames(scene: Scene, parts: Sequence[Float], params: ExplicitParams, count: int) -> list[int]:
    """Those that are named, else at most so many; `parts`: of `likenesses`."""
    named = params.segments.named
    return named_frames(scene, named) if named else farthest_first(comparable(parts), count)
