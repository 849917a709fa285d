"""A scene with the mattes that a stage is to go by: its own, or those that the stage `matte` has left."""

from __future__ import annotations

from dataclasses import replace

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.files import read_json
from facefolds_core.paths import SubjectFolders
from facefolds_core.reading import is_there

USE, MATTES = "use.json", "mattes.arrow"
SCENES = "scene"
"""In `mattes/training/use.json`: the scene's own mattes train. Else those beside it do, none if there are none."""


def training_scene(folders: SubjectFolders) -> Scene:
    """With the mattes that train; where `matte` has not run, the scene's own."""
    scene, place = read_scene(folders.scene), folders.mattes / "training"
    if not is_there(place / USE) or read_json(place / USE).get("mattes") == SCENES:
        return scene
    return replace(scene, mattes=place / MATTES)


def scored_scene(folders: SubjectFolders) -> Scene:
    """With all mattes that there are."""
    scene, path = read_scene(folders.scene), folders.mattes / MATTES
    return replace(scene, mattes=path) if is_there(path) else scene
