"""Layouts of captures: each module of this package reads one, named as `source` of a subject in params.yaml.

A module has

    def read(root: Path, subject: Subject) -> Capture

which reads everything but the pixels, or raises `UserError`. The actor's reads what the stage `capture` has
made; all others read the folder or file that `path` names, and have

    def recognise(root: Path) -> Recognised | None

which says, from names of files alone, whether `root` is of this layout (`facefolds doctor`, and who names a wrong
source). The first line of a module's docstring names the layout.
"""

from __future__ import annotations

from facefolds_core.captures.capture import Capture
from facefolds_core.captures.looking import check_layout
from facefolds_core.files.paths import SubjectFolders, check_place
from facefolds_core.params import CaptureParams, Subject
from facefolds_core.registry import SOURCES


def read_capture(subject: Subject, folders: SubjectFolders, params: CaptureParams) -> Capture:
    """The capture of any source.

    Args:
        params: at whose rate a generated capture was made.

    Raises:
        UserError: if its place is none that may be read, or what is there is damaged.
    """
    if subject.is_generated:
        place = folders.capture
        subject = subject.model_copy(update={"fps": subject.fps or params.frame_rate})
    else:
        place = check_place(subject.path, folders, "path")
        check_layout(subject.source, place)
    capture: Capture = SOURCES[subject.source].read(place, subject)
    return capture
