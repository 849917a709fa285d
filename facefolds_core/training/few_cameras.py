"""The parameters of a training of few cameras."""

from __future__ import annotations

from facefolds_core.facts import Fact, fact
from facefolds_core.params import ExplicitParams


def for_cameras(params: ExplicitParams, cameras: int) -> tuple[ExplicitParams, tuple[Fact, ...]]:
    """The parameters of a training with so many cameras, and what is to be said of them.

    With more than `few_cameras.at_most` they are `params` themselves. Applied twice they are as applied once.
    """
    few = params.few_cameras
    if cameras > few.at_most or cameras <= few.views:
        return params, ()
    volume, geometry = params.volume, params.geometry
    stricter = {
        "volume": volume.model_copy(
            update={
                "min_view_share": max(volume.min_view_share, few.views / cameras),
                "shared_view_share": max(volume.shared_view_share, min(few.shared_views, cameras) / cameras),
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
    return params.model_copy(update=stricter), (fact("few_cameras", cameras=cameras, most=few.at_most),)
