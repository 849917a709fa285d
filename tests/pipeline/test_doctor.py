"""`facefolds doctor` mends what a killed DVC leaves; the real DVC agrees, and loses nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from facefolds_core.cli import app, mending
from facefolds_core.cli.mending import mend
from facefolds_core.errors import UserError
from facefolds_core.params import STAGE_SECTIONS
from facefolds_core.system.locks import try_lock
from stages import common

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


RWLOCK_WORDS = "Unable to read RWLock-file '.dvc/tmp/rwlock'. JSON structure is corrupted"
LOCK_WORDS = "'./dvc.lock' validation failed"


def says(text: str, words: str) -> bool:
    """Whether the words are there, however the lines are broken."""
    return words in " ".join(text.split())


def test_the_documents_have_the_words_by_which_one_finds_them(project_root: Path) -> None:
    text = (project_root / "docs" / "reference" / "command.md").read_text(encoding="utf-8")
    assert says(text, RWLOCK_WORDS) and says(text, LOCK_WORDS)
    assert says((project_root / "README.md").read_text(encoding="utf-8"), "say that a file is corrupted")


def test_facefolds_run_mends_before_it_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("dask")
    monkeypatch.chdir(tmp_path)
    sections = "".join(f"{name}: {{}}\n" for name in STAGE_SECTIONS)
    (tmp_path / "params.yaml").write_text(f"subjects:\n  anna: {{source: actor, path: .}}\n{sections}")
    (tmp_path / ".dvc" / "tmp").mkdir(parents=True)
    (tmp_path / ".dvc" / "tmp" / "rwlock").write_text("")
    done = CliRunner().invoke(app, ["run", "--subjects", "nobody"])
    assert "rwlock was damaged" in done.output and "nobody" in done.output
    assert not (tmp_path / ".dvc" / "tmp" / "rwlock").exists()


def test_a_stage_whose_dvc_was_killed_says_what_may_be_damaged(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for dvc_stage, said in (("train@anna", True), (None, False)):
        if dvc_stage is None:
            monkeypatch.delenv("DVC_STAGE", raising=False)
        else:
            monkeypatch.setenv("DVC_STAGE", dvc_stage)
        monkeypatch.setattr(sys, "argv", ["train", "--subject", "anna"])
        monkeypatch.setattr(common, "end_with_parent", lambda: None)
        with pytest.raises(SystemExit) as ended:
            common.run_stage("train", lambda _: os.kill(os.getpid(), signal.SIGTERM) or "", "")
        assert ended.value.code == 128 + signal.SIGTERM
        told = capsys.readouterr().err
        assert "train: ended by SIGTERM" in told and ("`facefolds doctor` mends it" in told) is said


def dvc(root: Path, fails: bool = False) -> str:
    """What `dvc repro` says, having succeeded (or not)."""
    command, variables = [sys.executable, "-m", "dvc", "repro"], {**os.environ, "DVC_NO_ANALYTICS": "1"}
    done = subprocess.run(command, cwd=root, env=variables, capture_output=True, text=True)
    assert (done.returncode != 0) == fails, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which DVC ran a stage."""
    root = tmp_path_factory.mktemp("dvc")
    (root / ".dvc").mkdir()
    (root / ".dvc" / "config").write_text("[core]\n    analytics = false\n    no_scm = true\n")
    (root / "dvc.yaml").write_text(PIPELINE)
    (root / "in.txt").write_text("1")
    dvc(root)
    return root


@pytest.fixture
def lock(project: Path) -> Iterator[Path]:
    """Its dvc.lock, which is whole again after the test."""
    good = (project / "dvc.lock").read_bytes()
    yield project / "dvc.lock"
    (project / "dvc.lock").write_bytes(good)


def test_whole_files_are_left_alone(project: Path) -> None:
    files = [project / "dvc.lock", project / ".dvc" / "tmp" / "rwlock"]
    before = [(path.read_bytes(), path.stat().st_mtime_ns) for path in files]
    assert mend(project) == []
    assert [(path.read_bytes(), path.stat().st_mtime_ns) for path in files] == before


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_dvc_lock_is_moved_away_and_nothing_runs_again(project: Path, lock: Path, name: str) -> None:
    content = DAMAGED[name].encode(errors="surrogateescape")
    lock.write_bytes(content)
    asked = name == "empty"  # DVC itself, which takes seconds
    assert not asked or says(dvc(project, fails=True), LOCK_WORDS)
    ran = (project / "ran.txt").read_text()
    (line,) = mend(project)
    assert "dvc.lock" in line
    if asked:
        dvc(project)
        assert (project / "ran.txt").read_text() == ran
    (kept,) = project.glob("dvc.lock.damaged*")
    assert kept.read_bytes() == content
    kept.unlink()


def test_a_damaged_list_of_files_in_use(project: Path) -> None:
    (project / ".dvc" / "tmp" / "rwlock").write_text("")
    (project / "dvc.lock").unlink()
    assert says(dvc(project, fails=True), RWLOCK_WORDS)
    (line,) = mend(project)
    assert "rwlock" in line
    dvc(project)


def test_earlier_damaged_ones_are_kept(project: Path, lock: Path) -> None:
    for name in ("first", "second"):
        lock.write_text(f"{name}: [")
        mend(project)
    found = {path.read_text(errors="replace") for path in project.glob("dvc.lock.damaged*")}
    assert found == {"first: [", "second: ["}


def test_a_dvc_at_work_is_not_disturbed(project: Path, lock: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its lock is the one that DVC itself waits for."""
    monkeypatch.setattr(mending, "PATIENCE", 0.2)
    with closing(try_lock(project / ".dvc" / "tmp" / "lock")):
        assert "Unable to acquire lock" in dvc(project, fails=True)
        lock.write_text("")
        with pytest.raises(UserError, match="DVC is at work"):
            mend(project)
        assert lock.exists()


def test_the_command_says_what_it_mended(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (project / "dvc.lock").write_text("")
    monkeypatch.chdir(project)
    done = CliRunner().invoke(app, ["doctor"])
    assert done.exit_code == 0, done.output
    assert "doctor: dvc.lock was damaged" in done.stdout
    assert not (project / "dvc.lock").exists()
