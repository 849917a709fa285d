"""A stage keeps a second run of it out, and ends with the DVC that started it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import psutil
import pytest

from facefolds_core.errors import UserError
from facefolds_core.pipeline import running
from facefolds_core.pipeline.running import alone
from facefolds_core.system.locks import try_lock
from facefolds_core.system.processes import own_environment

STAGE = """
import os, sys, time
from pathlib import Path
from facefolds_core.files.writing import atomic_folder
from stages.common import run_stage

def work(folders):
    with atomic_folder(folders.model) as temporary:
        (temporary / "half").write_text("1")
        Path("ready").write_text(str(os.getpid()))
        time.sleep(float(Path("seconds").read_text()))
    return "made"

run_stage("train", work, "A stage.")
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "stage.py").write_text(STAGE)
    (tmp_path / "seconds").write_text("60")
    return tmp_path


def make_pipeline(folder: Path, command: str) -> None:
    """For DVC, of one stage."""
    (folder / ".dvc").mkdir()
    (folder / ".dvc" / "config").write_text("[core]\n    analytics = false\n    no_scm = true\n")
    (folder / "dvc.yaml").write_text(f"stages:\n  train:\n    cmd: {command}\n    outs: [data/x/model]\n")


BY_HAND = (sys.executable, "stage.py", "--subject", "x")


def start(folder: Path, root: Path, *command: str, **more: str) -> subprocess.Popen[str]:
    environment = own_environment(PYTHONPATH=str(root), DVC_NO_ANALYTICS="1", **more)
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def wait_for(path: Path) -> int:
    deadline = time.monotonic() + 30
    while not (path.exists() and path.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return int(path.read_text())


def has_ended(pid: int, within: float) -> bool:
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return True
        time.sleep(0.02)
    return False


def test_a_second_run_is_told_who_is_at_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "LOCK_WAIT", 0.2)
    locks = tmp_path / "locks"
    says = f"another run of train is at work: process {os.getpid()}"
    with alone("train", locks), alone("sample", locks), pytest.raises(UserError, match=says):
        alone("train", locks).__enter__()
    with alone("train", locks):
        pass


def test_a_killed_run_keeps_nobody_out(folder: Path, project_root: Path) -> None:
    process = start(folder, project_root, *BY_HAND)
    wait_for(folder / "ready")
    process.kill()
    process.communicate()
    (folder / "seconds").write_text("0")
    process = start(folder, project_root, *BY_HAND)
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 0, output
    assert sorted(p.name for p in (folder / "data" / "x").iterdir()) == ["locks", "model"]


@pytest.mark.parametrize(("number", "shell"), [(signal.SIGTERM, ""), (signal.SIGKILL, "true; ")])
def test_a_stage_ends_with_its_dvc(number: signal.Signals, shell: str, folder: Path, project_root: Path) -> None:
    """With `true;` the shell that DVC starts stays between DVC and the stage."""
    make_pipeline(folder, f"{shell}python stage.py --subject x")
    process = start(folder, project_root, sys.executable, "-m", "dvc", "repro", SHELL="/bin/bash")
    stage = wait_for(folder / "ready")
    process.send_signal(number)
    try:
        assert has_ended(stage, 5)
    finally:
        if psutil.pid_exists(stage):
            os.kill(stage, signal.SIGKILL)
        process.communicate()
    assert [p.name for p in (folder / "data" / "x").iterdir()] == ["locks"]


def test_a_stage_started_by_hand_outlives_its_terminal(folder: Path, project_root: Path) -> None:
    command = f"nohup {sys.executable} stage.py --subject x > log.txt 2>&1 & wait"
    process = start(folder, project_root, "bash", "-c", command)
    stage = wait_for(folder / "ready")
    process.kill()
    process.communicate()
    assert not has_ended(stage, 1)
    os.kill(stage, signal.SIGKILL)


def test_what_ends_while_another_dvc_holds_the_lock_is_recorded(folder: Path, project_root: Path) -> None:
    """DVC gives up after 3 s; the stage therefore waits before it ends."""
    make_pipeline(folder, "python stage.py --subject x")
    (folder / "seconds").write_text("1")
    process = start(folder, project_root, sys.executable, "-m", "dvc", "repro")
    wait_for(folder / "ready")
    with closing(try_lock(folder / ".dvc" / "tmp" / "lock")):
        time.sleep(6)
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 0, output
    assert "waiting for another DVC" in output
    assert "data/x/model" in (folder / "dvc.lock").read_text()
