"""What players' pictures are compared with: five cameras, and what the reference renderer shows from them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from facefolds_core.asset import Asset
from facefolds_core.asset.reader import AssetLevel
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.areas import AreaView
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import BLACK, AssetCaster, Layered, composite, room_from, seen_from
from facefolds_core.rendering.reflection import reflected_colours
from tests.scenes import look_at_origin

GREY = "#7f7f7f"
GREY_VALUE = 127 / 255


def five_cameras(size: int) -> list[Camera]:
    """Frontal, 45 degrees to both sides, from above, grazing."""
    places = {"front": (0, 0), "left": (45, 0), "right": (-45, 10), "above": (15, 40), "grazing": (80, 5)}
    return [look_at_origin(name, azimuth, elevation, size) for name, (azimuth, elevation) in places.items()]


def turned_cameras(size: int) -> list[Camera]:
    """From the front to the subject's left side, a little from above; named by degrees."""
    return [look_at_origin(str(azimuth), azimuth, 3, size) for azimuth in (0, 30, 45, 60, 80)]


def psnr(found: NDArray[Any], expected: NDArray[Any]) -> float:
    error = float(np.mean((np.asarray(found, np.float64) - expected) ** 2))
    return float(-10 * np.log10(max(error, 1e-12)))


def render_asset(
    asset: Layered, camera: Camera, frame: int, background: ArrayLike = BLACK
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """One ray a pixel: rgb (H, W, 3) and alpha (H, W) of a frame; a head with a track stands as it did then."""
    return composite(AssetCaster(asset, frame).cast(seen_from(asset, camera, frame)), asset.frame(frame), background)


def expected_pictures(
    asset: Asset | AssetLevel, cameras: Sequence[Camera], frames: Sequence[int], means: bool = False
) -> dict[tuple[str, int], NDArray[np.float32]]:
    """One ray a pixel, or means over pixels, over grey, the head at rest: by camera's name and frame (H, W, 3) in
    [0, 1]."""
    caster = AssetCaster(asset)
    looks = {
        camera.name: _view_at_rest(asset, camera).composite if means else partial(composite, caster.cast(camera))
        for camera in cameras
    }
    return {
        (name, frame): look(textures, (GREY_VALUE,) * 3)[0]
        for frame, textures in [(frame, asset.frame(frame)) for frame in frames]
        for name, look in looks.items()
    }


def lit_picture(
    level: Asset | AssetLevel, camera: Camera, frame: int, room: NDArray[np.float64] | None = None
) -> NDArray[np.float32]:
    """(H, W, 3): one ray a pixel, over grey, with the reflection, the head where it stood in the light of its room.

    Args:
        room: rotation from the meshes' axes to those of the light, by default that of the head.
    """
    maps, seen_by = level.reflection(), seen_from(level, camera, frame)
    assert maps is not None
    hits, turned = AssetCaster(level).cast(seen_by), room_from(level, frame) if room is None else room
    added = reflected_colours(hits, seen_by, level.windows, maps, turned)
    return composite(hits, level.frame(frame), (GREY_VALUE,) * 3, added)[0]


def means_of_frames(asset: Asset | AssetLevel, camera: Camera) -> list[NDArray[np.float32]]:
    """Means over pixels of all frames, by one camera."""
    view = _view_at_rest(asset, camera)
    return [view.composite(textures, (GREY_VALUE,) * 3)[0] for textures in asset.frames()]


def _view_at_rest(asset: Asset | AssetLevel, camera: Camera) -> AreaView:
    return AreaView.of_hits(camera, lambda part: (cast_layers(part, asset.layers), None))
