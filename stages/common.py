"""What every stage's command has in common: arguments, timing, messages, errors."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import report_user_errors
from facefolds_core.files import write_json
from facefolds_core.paths import SubjectFolders, check_subject_name, subject_folders, subject_of_dvc_stage

Data = Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")]
Work = Callable[[SubjectFolders], str]
"""Does a stage's work on one subject's folders and returns one line that says what was made and where."""


def run_stage(name: str, work: Work, help_text: str) -> None:
    """Parse the command line of a stage, run it, write its timing, say what was made.

    Args:
        name: of the stage.
        work: does it.
        help_text: shown by --help.
    """

    def command(
        subject: Annotated[str, typer.Option(help="Name of the subject in params.yaml; DVC tells it itself.")] = "",
        data: Data = Path("data"),
    ) -> None:
        with report_user_errors(name):
            folders = subject_folders(data, subject or subject_of_dvc_stage(name, os.environ.get("DVC_STAGE", "")))
            start = time.perf_counter()
            made = work(folders)
            seconds = time.perf_counter() - start
            write_json(folders.timing(name), {"stage": name, "seconds": round(seconds, 3)})
            typer.echo(f"{name}: {made} ({seconds:.1f} s)")

    _run(name, command, help_text)


def run_for_all(name: str, work: Callable[[Path], str], help_text: str) -> None:
    """As `run_stage`, for a stage that works on all subjects at once.

    Args:
        work: takes the folder that holds one folder a subject.
    """

    def command(
        subject: Annotated[str, typer.Option(help="Not needed: all subjects' files are written.")] = "",
        data: Data = Path("data"),
    ) -> None:
        with report_user_errors(name):
            if subject:
                check_subject_name(subject)
            start = time.perf_counter()
            made, *notes = work(data).splitlines()
            typer.echo("\n".join([f"{name}: {made} ({time.perf_counter() - start:.1f} s)", *notes]))

    _run(name, command, help_text)


def _run(name: str, command: Callable[..., None], help_text: str) -> None:
    command.__doc__ = help_text
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command(name=name)(command)
    app()
