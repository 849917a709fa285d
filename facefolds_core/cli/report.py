"""Make a page that tells all about a subject: `facefolds report data/<subject>` (docs/guide/report.md)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.reporting.build import make_report
from facefolds_core.serving.player import find_player


def evaluated_subjects(data: Path) -> list[Path]:
    """Folders of the subjects under `data` that have scores.

    Raises:
        UserError: if there is none.
    """
    found = sorted(path.parent for path in data.glob("*/metrics.json"))
    if not found:
        raise UserError(
            "no subject has been evaluated yet", file=data, remedy="run `make repro` first, or name a subject's folder"
        )
    return found


def built_player() -> Path | None:
    """The web player, to show assets with; None, and said so, where it has not been built."""
    try:
        return find_player()
    except UserError:
        typer.echo("report: without the face, playing: the web player has not been built (`make view` builds it)")
        return None


def command(
    subjects: Annotated[
        list[Path] | None, typer.Argument(help="Folders of subjects. Left out: all under --data that have scores.")
    ] = None,
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
) -> None:
    """Write one self-contained page a subject, report.html in its folder: pictures, scores, costs."""
    with report_user_errors("report"):
        player = built_player()
        for folder in subjects or evaluated_subjects(data):
            start = time.perf_counter()
            path = make_report(SubjectFolders(folder), player)
            seconds = time.perf_counter() - start
            typer.echo(f"report: {path} ({path.stat().st_size / 1e6:.1f} MB, {seconds:.1f} s)")
