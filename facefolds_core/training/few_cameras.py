"""The parameters of a training of few cameras."""

from __future__ import annotations

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.params import ExplicitParams


def for_scene(params: ExplicitParams, scene: Scene) -> tuple[ExplicitParams, tuple[Fact, ...]]:
    """The parameters of a training of the scene's cameras, and what is to be said of them; see `for_cameras`."""
    cameras, plates = scene.indices("train"), scene.open_plates()
    known = plates is not None and all((camera, 0) in plates for camera in cameras)
    return for_cameras(params, len(cameras)) if known else (params, ())


def for_cameras(params: ExplicitParams, count: int) -> tuple[ExplicitParams, tuple[Fact, ...]]:
    """The parameters of a training of so many cameras with a clean plate each, and what is to be said of them.

    With more than `few_cameras.at_most` they are `params` themselves. Where it is not known what stands behind the
    subject nobody may ask for this: a price on opacity takes the subject for the room. Applied twice they are as
    applied once.
    """
    few = params.few_cameras
    if count > few.at_most or count <= few.views:
        return params, ()
    volume, geometry = params.volume, params.geometry
    stricter = {
        "volume": volume.model_copy(
            update={
                "min_view_share": max(volume.min_view_share, few.views / count),
                "shared_view_share": max(volume.shared_view_share, min(few.shared_views, count) / count),
                "opacity_weight": max(volume.opacity_weight, few.opacity_weight),
            }
        ),
        "geometry": geometry.model_copy(
            update={
                "max_halfwidth": min(geometry.max_halfwidth, few.max_halfwidth),
                "blur": max(geometry.blur, few.blur),
            }
        ),
    }
    return params.model_copy(update=stricter), (fact("few_cameras", cameras=count, most=few.at_most),)
