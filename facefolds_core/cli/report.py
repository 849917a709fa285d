"""Make a page that tells all about a subject: `facefolds report data/<subject>` (docs/guide/report.md)."""

from __future__ import annotations

import time
from pathlib import Path

import typer

from facefolds_core.cli.scores import Data, Subjects, evaluated_subjects
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.reporting.build import make_report
from facefolds_core.serving.player import find_player


def built_player() -> Path | None:
    """The web player, to show assets with; None, and said so, where it has not been built."""
    try:
        return find_player()
    except UserError:
        typer.echo("report: without the face, playing: the web player has not been built (`make view` builds it)")
        return None


def command(subjects: Subjects = None, data: Data = Path("data")) -> None:
    """Write one self-contained page a subject, report.html in its folder: pictures, scores, costs."""
    with report_user_errors("report"):
        player = built_player()
        for folders in evaluated_subjects(subjects, data):
            start = time.perf_counter()
            path = make_report(folders, player)
            seconds = time.perf_counter() - start
            typer.echo(f"report: {path} ({path.stat().st_size / 1e6:.1f} MB, {seconds:.1f} s)")
