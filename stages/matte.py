"""Find where the subject is in the pictures, to look at and to correct: data/<subject>/mattes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import typer

from facefolds_core.captures.scene import read_scene
from facefolds_core.config import read_stage, read_subject, read_volume_source
from facefolds_core.params import MatteParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.subject.cutouts import from_gaussians
from facefolds_core.training.mattes.folder import make_mattes
from stages.common import run_stage

WORDS = {"capture": "from the capture", "named": "named by hand", "plate": "beside plates", "picture": "cut out"}


def matte(folders: SubjectFolders) -> str:
    params, named = read_stage(MatteParams, folders.config), read_subject(folders.config).mattes
    start = read_volume_source(folders.config)
    place = None if named is None else Path(named)
    scene = read_scene(folders.scene)
    found, notes = make_mattes(scene, folders.mattes, params, start, place, from_gaussians)
    for note in notes:
        typer.echo(f"matte: {note}")
    if not found:
        return f"no mattes (`matte.method` is {params.method!r})"
    counts = Counter(one.source for one in found if one.believed)
    sources = ", ".join(f"{count} {WORDS[source]}" for source, count in counts.items())
    names = [f"{scene.cameras[one.camera].name} {scene.frame_ids[one.frame]}" for one in found if not one.believed]
    more = f"; outvoted, and left out: {', '.join(names)}" if names else ""
    return f"{sources}; look at {folders.mattes / 'sheet.png'}{more}"


if __name__ == "__main__":
    run_stage("matte", matte, __doc__ or "")
