"""What every stage's command has in common: arguments, timing, messages, errors."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import psutil
import typer

from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import write_json
from facefolds_core.locks import holding, owner
from facefolds_core.paths import SubjectFolders, check_subject_name, subject_folders, subject_of_dvc_stage

Data = Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")]
Work = Callable[[SubjectFolders], str]
"""Does a stage's work on one subject's folders, and says in a line what was made and where; more lines may follow."""

LOCK_WAIT = 20.0
"""Seconds that a stage waits for another run of it, which may be ending, on the same subject."""

LOOK = 0.25
"""Seconds between two looks at DVC's process."""

GRACE = 10.0
"""Seconds that a stage may clean up after DVC ended, before it is killed."""


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
            end_with_dvc()
            folders = subject_folders(data, subject or subject_of_dvc_stage(name, os.environ.get("DVC_STAGE", "")))
            with alone(name, folders.root / "locks"):
                start = time.perf_counter()
                made = work(folders)
                seconds = time.perf_counter() - start
                write_json(folders.timing(name), {"stage": name, "seconds": round(seconds, 3)})
                said, *more = made.splitlines()
                typer.echo("\n".join([f"{name}: {said} ({seconds:.1f} s)", *more]))

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
            end_with_dvc()
            if subject:
                check_subject_name(subject)
            with alone(name, data / ".locks"):
                start = time.perf_counter()
                made, *notes = work(data).splitlines()
                typer.echo("\n".join([f"{name}: {made} ({time.perf_counter() - start:.1f} s)", *notes]))

    _run(name, command, help_text)


def _run(name: str, command: Callable[..., None], help_text: str) -> None:
    command.__doc__ = help_text
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command(name=name)(command)
    app()


@contextmanager
def alone(name: str, locks: Path) -> Iterator[None]:
    """Keep a second run of the stage out while the block runs.

    Args:
        locks: folder of the locks: a subject's, or that of all subjects.

    Raises:
        UserError: if another run is at work, and does not end within LOCK_WAIT.
    """
    path = locks / name
    with holding(path, LOCK_WAIT) as free:
        if not free:
            raise UserError(
                f"another run of {name} is at work: {owner(path)}",
                file=path,
                remedy="let it end, or end it, and run the same command again",
            )
        yield


def end_with_dvc() -> None:
    """End this stage when the DVC that started it has ended, however it ended: nobody else waits for its results.

    A stage started by hand goes on: its terminal may be closed on purpose (`nohup`).

    A thread looks; Linux' PR_SET_PDEATHSIG would be sent when the thread of DVC that started us ends, not DVC, and
    not at all where a shell stands between.
    """
    if "DVC_STAGE" not in os.environ:  # DVC sets it for the commands that it runs
        return
    parent = psutil.Process().parent()
    if parent is None:
        return
    chain = [(psutil.Process(), parent.pid)]
    try:
        if "-c" in parent.cmdline()[1:] and (above := parent.ppid()):  # a shell that waits for us
            chain.append((parent, above))
    except psutil.Error:
        pass  # it ended just now: the thread sees it
    threading.Thread(target=_watch, args=(chain,), daemon=True, name="end with DVC").start()


def _watch(chain: list[tuple[psutil.Process, int]]) -> None:
    """Wait until a process of `chain` has another parent than the one noted, which has ended; then end this one."""
    while all(_parent(child) == pid for child, pid in chain):
        time.sleep(LOOK)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os.kill(os.getpid(), signal.SIGKILL)


def _parent(process: psutil.Process) -> int:
    try:
        return int(process.ppid())
    except psutil.Error:
        return -1
