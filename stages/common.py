"""What every stage's command has in common: arguments, timing, messages, errors."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import report_user_errors
from facefolds_core.files.paths import check_subject_name, subject_folders, subject_of_dvc_stage
from facefolds_core.pipeline.running import Work, alone, run_alone
from facefolds_core.system.locks import try_lock
from facefolds_core.system.processes import end_with_parent

KILLED = "if DVC was killed, and says the next time that a file is corrupted, `facefolds doctor` mends it"
"""What a stage says that ends with its DVC: a DVC that is killed can leave files that stop it before any stage runs."""

LOOK = 0.25
"""Seconds between two looks at DVC's lock."""


def run_stage(name: str, work: Work, help_text: str) -> None:
    """Parse the command line of a stage, run it, write its timing, say what was made.

    Args:
        name: of the stage.
        work: does it.
        help_text: shown by --help.
    """

    def of_one(subject: str, data: Path) -> str:
        subject = subject or subject_of_dvc_stage(name, os.environ.get("DVC_STAGE", ""))
        return run_alone(name, work, subject_folders(data, subject))

    _run(name, of_one, help_text)


def run_for_all(name: str, work: Callable[[Path], str], help_text: str) -> None:
    """As `run_stage`, for a stage that works on all subjects at once.

    Args:
        work: takes the folder that holds one folder a subject.
    """

    def of_all(subject: str, data: Path) -> str:
        if subject:
            check_subject_name(subject)
        with alone(name, data / ".locks"):
            start = time.perf_counter()
            made, *notes = work(data).splitlines()
            return "\n".join([f"{name}: {made} ({time.perf_counter() - start:.1f} s)", *notes])

    _run(name, of_all, help_text)


def _run(name: str, work: Callable[[str, Path], str], help_text: str) -> None:
    """Args: work: takes the subject's name, "" if none is given, and the folder of all; says what was made."""

    def command(
        subject: Annotated[
            str, typer.Option(help="Name of the subject in params.yaml; DVC tells it itself, `configure` needs none.")
        ] = "",
        data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    ) -> None:
        with report_user_errors(name, KILLED if "DVC_STAGE" in os.environ else ""):
            end_with_dvc()
            typer.echo(work(subject, data))
            wait_for_other_dvcs()

    command.__doc__ = help_text
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command(name=name)(command)
    app()


def end_with_dvc() -> None:
    """End this stage when the DVC that started it has ended, however it ended: nobody else waits for its results.

    A stage started by hand goes on: its terminal may be closed on purpose (`nohup`).
    """
    if "DVC_STAGE" in os.environ:  # DVC sets it for the commands that it runs
        end_with_parent()


def wait_for_other_dvcs() -> None:
    """Wait until no other DVC holds the lock of this project's folder.

    The DVC that started this stage takes the lock when the stage has ended, gives up after 3 s (treeverse/dvc,
    dvc/lock.py), and then what was made is not recorded: made for nothing. Others hold it while they hash or push.
    """
    root = os.environ.get("DVC_ROOT")
    if root is None:
        return
    told = False
    while (lock := _try_dvcs_lock(Path(root, ".dvc", "tmp", "lock"))) is None:
        if not told:
            typer.echo("waiting for another DVC that is at work in this folder, so that what was made is recorded")
            told = True
        time.sleep(LOOK)
    lock.close()


def _try_dvcs_lock(path: Path) -> FileIO | None:
    try:
        return try_lock(path, create=False)
    except OSError:  # no such file, or one that is not ours to open: nobody to wait for
        return FileIO(os.devnull)
