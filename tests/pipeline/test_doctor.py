"""`facefolds doctor` mends what a killed DVC leaves; the real DVC agrees, and loses nothing."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from facefolds_core.cli import mending
from facefolds_core.cli.mending import mend
from facefolds_core.errors import UserError
from facefolds_core.locks import try_lock

PIPELINE = """\
stages:
  a:
    cmd: mkdir -p out && echo ran >> ran.txt && echo made > out/x
    deps: [in.txt]
    outs: [out]
"""
DAMAGED = {
    "empty": "",
    "cut": 'schema: "2.0"\nsta',
    "without stages": 'schema: "2.0"\nstages:\n',
    "conflict": '<<<<<<< HEAD\nschema: "2.0"\n',
    "no text": "\udcff",
}


def dvc(root: Path) -> tuple[int, str]:
    command = [sys.executable, "-m", "dvc", "repro"]
    done = subprocess.run(
        command, cwd=root, env={**os.environ, "DVC_NO_ANALYTICS": "1"}, capture_output=True, text=True
    )
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which DVC ran a stage."""
    root = tmp_path_factory.mktemp("dvc")
    (root / ".dvc").mkdir()
    (root / ".dvc" / "config").write_text("[core]\n    analytics = false\n    no_scm = true\n")
    (root / "dvc.yaml").write_text(PIPELINE)
    (root / "in.txt").write_text("1")
    status, output = dvc(root)
    assert status == 0, output
    return root


def test_whole_files_are_left_alone(project: Path) -> None:
    files = [project / "dvc.lock", project / ".dvc" / "tmp" / "rwlock"]
    before = [(path.read_bytes(), path.stat().st_mtime_ns) for path in files]
    assert mend(project) == []
    assert [(path.read_bytes(), path.stat().st_mtime_ns) for path in files] == before


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_dvc_lock_is_moved_away_and_nothing_runs_again(project: Path, name: str) -> None:
    content = DAMAGED[name].encode(errors="surrogateescape")
    (project / "dvc.lock").write_bytes(content)
    status, output = dvc(project)
    assert status != 0, output
    ran = (project / "ran.txt").read_text()
    (line,) = mend(project)
    assert "dvc.lock" in line
    status, output = dvc(project)
    assert status == 0, output
    assert (project / "ran.txt").read_text() == ran
    kept = list(project.glob("dvc.lock.damaged*"))
    assert [path.read_bytes() for path in kept] == ([content] if content else [])
    for path in kept:
        path.unlink()


def test_a_damaged_list_of_files_in_use(project: Path) -> None:
    (project / ".dvc" / "tmp" / "rwlock").write_text("")
    (project / "dvc.lock").unlink()
    status, output = dvc(project)
    assert status != 0, output
    (line,) = mend(project)
    assert "rwlock" in line
    status, output = dvc(project)
    assert status == 0, output


def test_earlier_damaged_ones_are_kept(project: Path) -> None:
    good = (project / "dvc.lock").read_bytes()
    for name in ("first", "second"):
        (project / "dvc.lock").write_text(f"{name}: [")
        mend(project)
    found = {path.read_text(errors="replace") for path in project.glob("dvc.lock.damaged*")}
    assert found == {"first: [", "second: ["}
    (project / "dvc.lock").write_bytes(good)


def test_a_dvc_at_work_is_not_disturbed(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    good = (project / "dvc.lock").read_bytes()
    monkeypatch.setattr(mending, "PATIENCE", 0.2)
    lock = try_lock(project / ".dvc" / "tmp" / "lock")
    assert lock is not None
    try:
        (project / "dvc.lock").write_text("")
        with pytest.raises(UserError, match="DVC is at work"):
            mend(project)
        assert (project / "dvc.lock").exists()
    finally:
        lock.release()
        (project / "dvc.lock").write_bytes(good)


def test_the_lock_is_the_one_that_dvc_waits_for(project: Path) -> None:
    lock = try_lock(project / ".dvc" / "tmp" / "lock")
    assert lock is not None
    status, output = dvc(project)
    lock.release()
    assert status != 0
    assert "Unable to acquire lock" in output


def test_the_command_says_what_it_mended(project: Path, project_root: Path) -> None:
    (project / "dvc.lock").write_text("")
    environment = {**os.environ, "PYTHONPATH": str(project_root)}
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "facefolds_core", "doctor"], cwd=project, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "doctor: dvc.lock was empty: deleted" in done.stdout
    assert time.perf_counter() - start < 20
    assert not (project / "dvc.lock").exists()
