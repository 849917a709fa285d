"""Films of the held-out cameras, as many as a page has room for."""

from __future__ import annotations

from typing import Any

from facefolds_core.captures.scene import Scene
from facefolds_core.reporting.pictures import film as film_of
from facefolds_core.reporting.tables import place_of
from facefolds_core.reporting.words import frame_label
from facefolds_core.scoring.record import Record

MOST_FILM_BYTES = 8_000_000
"""Of all films in the page together."""


def films(record: Record | None, scene: Scene | None) -> dict[str, Any]:
    """Films of the held-out cameras, as many as the page has room for, and the worst picture beside them."""
    if record is None:
        return {"films": [], "films_left": 0, "film_size": (2, 1)}
    places = {camera.name: place_of(camera).angle for camera in scene.cameras} if scene else {}
    kept, room = [], MOST_FILM_BYTES
    for film in sorted(record.films, key=lambda one: places.get(one.camera, 0.0)):
        path = record.folder / film.file
        size = path.stat().st_size if path.is_file() else room + 1
        if size <= room:
            room -= size
            labels = [frame_label(scene.frame_ids if scene else (), name) for name in film.frames]
            kept.append(
                {"camera": film.camera, "fps": film.fps, "frames": film.frames, "labels": labels, "src": film_of(path)}
            )
    view = record.views[record.worst]
    width, height = view.truth.shape[1], view.truth.shape[0]
    return {"films": kept, "films_left": len(record.films) - len(kept), "film_size": (2 * width, height)}
