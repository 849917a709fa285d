"""What the subjects of a folder came to: `facefolds scores`, with which `make repro` ends."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import read_json
from facefolds_core.scoring.terminal import result_lines, score_lines

REMEDY = "make it again with `dvc repro`"


def lines_of(folders: SubjectFolders) -> list[str]:
    """Scores, warnings, size and place of one subject's asset.

    Raises:
        UserError: if its metrics.json is missing or garbled.
    """
    metrics: Any = read_json(folders.metrics, remedy=REMEDY)
    try:
        return [*score_lines(metrics), *result_lines(metrics, folders)]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UserError("garbled scores", file=folders.metrics, found=repr(error), remedy=REMEDY) from None


Subjects = Annotated[
    list[Path] | None, typer.Argument(help="Folders of subjects. Left out: all under --data that have scores.")
]
Data = Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")]


def evaluated_subjects(subjects: list[Path] | None, data: Path) -> list[SubjectFolders]:
    """Those that are named, or all under `data` that have scores.

    Raises:
        UserError: if there is none.
    """
    found = subjects or sorted(path.parent for path in data.glob("*/metrics.json"))
    if not found:
        remedy = "run `make repro` first, or name a subject's folder"
        raise UserError("no subject has been evaluated yet", file=data, remedy=remedy)
    return [SubjectFolders(folder) for folder in found]


def command(subjects: Subjects = None, data: Data = Path("data")) -> None:
    """Where each subject's asset is, what it weighs, how good it is, what is not well, and how to look at it."""
    with report_user_errors("scores"):
        typer.echo("\n\n".join("\n".join(lines_of(folders)) for folders in evaluated_subjects(subjects, data)))
