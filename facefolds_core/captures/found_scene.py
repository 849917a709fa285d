"""A scene with what the stage `subject` has found: its Gaussians, and mattes of all pictures."""

from __future__ import annotations

from dataclasses import replace

from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.reading import is_there

GAUSSIANS, MATTES = "gaussians.npz", "mattes.arrow"
"""In `data/SUBJECT/subject`."""


def found_scene(folders: SubjectFolders) -> Scene:
    """With what was found; where `subject` has not run, the scene alone."""
    scene, gaussians, mattes = read_scene(folders.scene), folders.subject / GAUSSIANS, folders.subject / MATTES
    if is_there(gaussians):
        scene = replace(scene, gaussians=gaussians)
    return replace(scene, mattes=mattes) if is_there(mattes) else scene
