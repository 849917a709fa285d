"""Generate the embedded actor in data/<subject>/capture; for other sources, note where the capture is."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.captures.actor import write_capture
from facefolds_core.config.stages import read_stage, read_subject
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders, check_place
from facefolds_core.files.reading import is_folder, is_regular
from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.params import CaptureParams, Subject
from facefolds_core.progress import progress


def capture(folders: SubjectFolders) -> str:
    subject = read_subject(folders.config)
    if subject.is_generated:
        return _generate(folders, subject, read_stage(CaptureParams, folders.config))
    path = check_place(subject.path, folders, "path")
    if not (is_folder(path) or is_regular(path)):
        raise UserError(
            "the capture is not there",
            file=path,
            place=f"subjects.{folders.root.name}.path in params.yaml",
            expected=f"a capture of source {subject.source}",
            found="nothing",
            remedy="correct the path (relative paths start at the project's folder), or put the capture there",
        )
    with atomic_folder(folders.capture) as temporary:
        _write_source(temporary, subject)
    return f"a note of {path} in {folders.capture}"


def _generate(folders: SubjectFolders, subject: Subject, params: CaptureParams) -> str:
    count = params.cameras * params.frames
    with progress(total=count, desc="capture", unit="picture") as bar, atomic_folder(folders.capture) as temporary:
        write_capture(temporary, params, lambda: bar.update())
        _write_source(temporary, subject)
    return f"{count} pictures of {params.width} x {params.height} in {folders.capture}"


def _write_source(folder: Path, subject: Subject) -> None:
    write_json(folder / "source.json", {"source": subject.source, "path": subject.path})
