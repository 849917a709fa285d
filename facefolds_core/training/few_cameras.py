"""The parameters of a training of few cameras."""

from __future__ import annotations

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.params import ExplicitParams
from facefolds_core.params.base import Section


def for_scene(params: ExplicitParams, scene: Scene) -> tuple[ExplicitParams, tuple[Fact, ...]]:
    """The parameters of a training of the scene's cameras, and what is to be said of them; see `for_cameras`."""
    cameras, plates = scene.indices("train"), scene.open_plates()
    known = plates is not None and all((camera, 0) in plates for camera in cameras)
    return for_cameras(params, len(cameras), known, turns=scene.poses is not None)


def for_cameras(
    params: ExplicitParams, count: int, plates: bool, turns: bool = False
) -> tuple[ExplicitParams, tuple[Fact, ...]]:
    """The parameters of a training of so many cameras, and what is to be said of them.

    A voxel must be seen by `few_cameras.views` of them, but for turning heads before more than `few_cameras.at_most`,
    with which nothing else changes; `views` cameras or fewer are left as they are. Applied twice they are as applied
    once.

    Args:
        plates: whether each has a clean plate. Where it is not known what stands behind the subject a price on opacity
            takes the subject for the room: then only single views are not believed, and texels are larger.
        turns: whether the head does: then one of many cameras sees it from several sides, and a share of the views,
            which are counted in each frame of the volume, is enough.
    """
    few = params.few_cameras
    volume, geometry, textures = params.volume, params.geometry, params.textures
    many = count > few.at_most
    if count <= few.views or (many and turns):
        return params, ()
    shared = few.views + 1 if many or not plates else min(max(few.shared_views, few.views + 1), count)
    seen = {
        "min_view_share": max(volume.min_view_share, few.views / count),
        "shared_view_share": max(volume.shared_view_share, shared / count),
    }
    if many:
        return params.model_copy(update={"volume": volume.model_copy(update=seen)}), ()
    stricter: dict[str, Section] = {}
    if plates:
        seen["opacity_weight"] = max(volume.opacity_weight, few.opacity_weight)
        stricter["geometry"] = geometry.model_copy(
            update={
                "max_halfwidth": min(geometry.max_halfwidth, few.max_halfwidth),
                "blur": max(geometry.blur, few.blur),
            }
        )
    else:
        texels = max(textures.pixels_per_texel, few.pixels_per_texel)
        stricter["textures"] = textures.model_copy(update={"pixels_per_texel": texels})
    stricter["volume"] = volume.model_copy(update=seen)
    if plates:
        note = fact("few_cameras", cameras=count, most=few.at_most)
    else:
        note = fact("few_cameras_no_plates", cameras=count, most=few.at_most)
    return params.model_copy(update=stricter), (note,)
