"""What every stage's command has in common: arguments, timing, messages, errors."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import report_user_errors
from facefolds_core.files import write_json
from facefolds_core.paths import SubjectFolders

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
        subject: Annotated[str, typer.Option(help="Name of the subject in params.yaml.")],
        data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    ) -> None:
        folders = SubjectFolders(data / subject)
        with report_user_errors(name):
            start = time.perf_counter()
            made = work(folders)
            seconds = time.perf_counter() - start
            write_json(folders.timing(name), {"stage": name, "seconds": round(seconds, 3)})
            typer.echo(f"{name}: {made} ({seconds:.1f} s)")

    command.__doc__ = help_text
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command(name=name)(command)
    app()
