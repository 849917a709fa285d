"""One job, on whichever machine it runs: a folder of its own, `dvc repro` in it, and the folder is gone again.

What it made is in DVC's cache, which the workers share, or was pushed to a DVC remote.
"""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import dask.system
from distributed import get_worker

from facefolds_core.cluster.lockfile import LOCK
from facefolds_core.cluster.project import Project
from facefolds_core.errors import UserError
from facefolds_core.system.processes import own_environment, with_threads

RUNNING = re.compile(r"Running stage '([^']+)'")
LOST_RECORD = re.compile(r"^ERROR: .*(\bruns\b.*\.tmp'|join\(\) argument must be .* not 'NoneType')", re.MULTILINE)
"""What DVC ends with where two jobs with a stage in common run it at once: one took the other's half-written record of
a run for a damaged one, and removed it, or found the record's folder before there was anything in it
(dvc/stage/cache.py, 3.x: `_load` takes the newest file of a folder)."""
ATTEMPTS = 5
LAST_LINES = 12
"""Of a failed job's log: what a stage's message has."""


@dataclass(frozen=True)
class Job:
    """What `dvc repro` is to make.

    Attributes:
        name: shown, and a part of file names.
        subject: whose metrics.json is looked at afterwards.
        target: of DVC: "evaluate@anna".
        params: the text of params.yaml, where it is another one than the project's.
        links: paths relative to the project, and where they really are: captures outside it.
        lock: what the project's dvc.lock says of the subject.
    """

    name: str
    subject: str
    target: str
    params: str | None
    links: tuple[tuple[str, str], ...]
    lock: str = ""


@dataclass(frozen=True)
class Outcome:
    """What became of a job.

    Attributes:
        error: why it failed, the last lines that were said; "" if it did not.
        ran: the stages that ran, `configure` left out; the others came from the cache.
        metrics: metrics.json; {} where there is none.
        log: all that DVC and the stages said.
        lock: the job's own dvc.lock; "" if it failed.
    """

    job: Job
    error: str = ""
    seconds: float = 0.0
    ran: tuple[str, ...] = ()
    metrics: Mapping[str, Any] | None = None
    log: str = ""
    lock: str = ""

    @property
    def state(self) -> str:
        """ "failed", "done" or "cached"."""
        return "failed" if self.error else "done" if self.ran else "cached"


_at_work: dict[str, list[subprocess.Popen[str]]] = {}
"""Run -> the DVCs of this worker, so that an interrupted run ends them."""


def do(job: Job, run: str) -> Outcome:
    """Do a job on this worker. Whatever the stages do wrong is an outcome, not an exception.

    Args:
        run: the name under which the project was handed to the workers (project.py).
    """
    worker = get_worker()
    project = worker.plugins[run]
    assert isinstance(project, Project)
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix=f"{job.name[:40]}-", dir=worker.local_directory) as temporary:
        try:
            root, pull = project.unfold(Path(temporary), dict(job.links), job.params, job.lock)
        except UserError as error:
            return Outcome(job, str(error))

        def tell(line: str) -> None:
            if found := RUNNING.match(line):
                worker.log_event(run, {"job": job.name, "stage": found[1], "host": socket.gethostname()})

        dvc = partial(_dvc, run, root, _environment(worker), tell)
        status, log = repro(dvc, ["repro", *(["--pull"] if pull else []), job.target])
        if pull:  # of a job that failed, too: what its first stages made
            pushed, said = dvc(["push", "--run-cache", "--with-deps", job.target])
            if pushed and not status:
                status, log = pushed, log + said
        metrics = root / "data" / job.subject / "metrics.json"
        return Outcome(
            job,
            error=_last_lines(log) if status else "",
            seconds=time.perf_counter() - start,
            ran=tuple(stage for stage in dict.fromkeys(RUNNING.findall(log)) if stage != "configure"),
            metrics=json.loads(metrics.read_text()) if not status and metrics.is_file() else {},
            log=log,
            lock="" if status else (root / LOCK).read_text(encoding="utf-8"),
        )


def repro(dvc: Callable[[Sequence[str]], tuple[int, str]], command: Sequence[str]) -> tuple[int, str]:
    """Exit status of a DVC command and all that was said; again where a record was lost to another job's DVC."""
    status, log = dvc(command)
    said = log
    for _ in range(ATTEMPTS - 1):
        if not status or not LOST_RECORD.search(said):
            break
        status, said = dvc(command)
        log += said
    return status, log


def _environment(worker: Any) -> dict[str, str]:
    """Of the job's processes: its share of the threads, the programs of this environment."""
    threads = max(1, dask.system.CPU_COUNT // worker.state.nthreads)
    return {**with_threads(threads), **own_environment(PYTHONUNBUFFERED="1")}


def _dvc(
    run: str, root: Path, environment: Mapping[str, str], tell: Callable[[str], None], command: Sequence[str]
) -> tuple[int, str]:
    """Exit status of a DVC command in a job's folder, and what it said.

    Args:
        run: that it is part of, with which it is ended.
        tell: hears each line that DVC says, at once.
    """
    lines = []
    with subprocess.Popen(
        [sys.executable, "-m", "facefolds_core.cluster.dvc", *command],
        cwd=root,
        env=dict(environment),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        start_new_session=True,  # so that its stages can be ended with it
    ) as process:
        _at_work.setdefault(run, []).append(process)
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            tell(line)
        status = process.wait()
        _at_work[run].remove(process)
    return status, "".join(lines)


def end_all(run: str) -> None:
    """End what this worker does for an interrupted run, DVC and its stages."""
    for process in _at_work.get(run, []):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)


def _last_lines(log: str) -> str:
    """The end of what a failed job said, without DVC's advice."""
    lines = [line.rstrip() for line in log.splitlines() if line.strip()]
    return "\n".join(lines[-LAST_LINES:]) or "it said nothing"
