"""Find who stands where: the subject's Gaussians, and mattes of all pictures: data/<subject>/subject."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from facefolds_core.captures.scene import read_scene
from facefolds_core.config.stages import read_stage, read_subject
from facefolds_core.facts import shorten
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.params import SubjectParams
from facefolds_core.subject.folder import make_folder

WORDS = {
    "capture": "from the capture",
    "named": "named by hand",
    "plate": "beside plates",
    "picture": "cut out",
    "gaussians": "from the Gaussians alone",
}


def subject(folders: SubjectFolders) -> str:
    params, entry, scene = (
        read_stage(SubjectParams, folders.config),
        read_subject(folders.config),
        read_scene(folders.scene),
    )
    named, start = (None if path is None else Path(path) for path in (entry.mattes, entry.start))
    found, told = make_folder(scene, folders.subject, params, named, start)
    counts = Counter(one["source"] for one in told)
    sources = ", ".join(f"{count} {WORDS[source]}" for source, count in counts.items())
    doubtful = [f"{one['camera']} {one['frame']}" for one in told if one["source"] == "gaussians"]
    more = f"; these pictures contradict the others: {shorten(doubtful, 300)}" if doubtful else ""
    return (
        f"{len(found.splats)} Gaussians, PSNR {found.psnr:.1f} dB; mattes: {sources}; "
        f"look at {folders.subject / 'sheet.png'}{more}"
    )
