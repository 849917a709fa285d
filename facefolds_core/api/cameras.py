"""Cameras by their names: those that an asset brings, and those of the scene that it was made of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from facefolds_core.asset.reader import Asset
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera

POSTER = "poster"
MOST_LISTED = 20


def camera_named(
    name: str, cameras: Iterable[Camera], place: str, none: str = "no camera is known", or_else: str = ""
) -> Camera:
    """The camera of that name.

    Args:
        place: of the name, for the message.
        none: what is expected where there are no cameras.
        or_else: what else the user can do.

    Raises:
        UserError: if there is none, listing those that there are.
    """
    known = []
    for camera in cameras:
        if camera.name == name:
            return camera
        known.append(camera.name)
    names = list(dict.fromkeys(known))
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    raise UserError(
        "no such camera",
        place=place,
        expected=", ".join(names[:MOST_LISTED]) + more or none,
        found=name,
        remedy=f"choose one of these{or_else}",
    )


def cameras_of_asset(asset: Asset, made_in: Path) -> Iterator[Camera]:
    """Of the poster, of the photos, and of the scene that the asset was made of, where that is there.

    Args:
        made_in: the subject's folder, which holds the scene.
    """
    poster = asset.manifest.poster
    if poster is not None and poster.K is not None and poster.w2c is not None:
        yield Camera(POSTER, np.array(poster.K), np.array(poster.w2c), poster.width, poster.height)
    for photo in asset.manifest.photos:
        yield Camera(photo.camera, np.array(photo.K), np.array(photo.w2c), photo.width, photo.height)
    scene = made_in / "scene"
    if (scene / "scene.json").is_file():
        from facefolds_core.captures.scene import read_scene  # playing an asset needs nothing of what makes one

        yield from read_scene(scene).cameras
