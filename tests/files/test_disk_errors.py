"""What a user's disk, path, memory or keyboard can cause is a message; what is ours keeps its traceback."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import torch
import yaml

import facefolds_core
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import PREFIX, write_text

ALWAYS = (
    *("ENOSPC", "EDQUOT", "EFBIG", "EACCES", "EPERM", "EROFS", "EIO", "EBUSY", "EISDIR", "ENOTDIR", "ELOOP"),
    *("ENAMETOOLONG", "EMFILE", "ENFILE", "ENOMEM", "ESTALE", "EXDEV"),
)


def said(call: Callable[[], object], capsys: pytest.CaptureFixture[str], status: int = 1) -> str:
    """What a command says that calls this, and ends with that status."""
    with pytest.raises(SystemExit) as stop, report_user_errors("train"):
        call()
    text = capsys.readouterr().err
    assert stop.value.code == status and "Traceback" not in text
    return text


def test_a_users_mistake_is_one_message_that_names_everything(capsys: pytest.CaptureFixture[str]) -> None:
    error = UserError("bad", file="KRT", place="line 3", expected="3 numbers", found="2", remedy="mend it")
    text = said(Mock(side_effect=error), capsys)
    assert all(part in text for part in ("train: error: bad", "KRT", "line 3", "3 numbers", "2", "mend it"))


@pytest.mark.parametrize("name", [*ALWAYS, "ENOENT", "EEXIST", "ENOTEMPTY"])
def test_errors_of_the_disk_name_the_file_and_the_remedy(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    number = getattr(errno, name)
    text = said(Mock(side_effect=OSError(number, os.strerror(number), "data/x/model")), capsys)
    assert "data/x/model" in text and "remedy" in text
    assert {"ENOSPC": "free some space", "EACCES": "no permission"}.get(name, "") in text


def test_an_error_without_a_name_does_not_invent_one(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(Mock(side_effect=OSError(errno.ENOSPC, "No space left on device")), capsys)
    assert "unknown" not in text and "file:" not in text


@pytest.mark.parametrize(
    "error",
    [
        OSError("no number"),
        OSError(errno.EINVAL, "Invalid argument", "data/x"),
        OSError(errno.EBADF, "Bad file descriptor"),
        FileNotFoundError(errno.ENOENT, "no name"),
        FileNotFoundError(errno.ENOENT, "package data", str(Path(facefolds_core.__file__).parent / "none.json")),
        FileNotFoundError(errno.ENOENT, "of a library", str(Path(np.__file__).parent / "none")),
        RecursionError("ours"),
        RuntimeError("ours"),
        KeyError("ours"),
    ],
)
def test_our_own_defects_keep_their_traceback(error: Exception) -> None:
    with pytest.raises(type(error)), report_user_errors("train"):
        raise error


def test_a_file_that_we_forgot_to_write_is_our_defect(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / f"{PREFIX}abcdefgh"
    folder.mkdir()
    error = FileNotFoundError(errno.ENOENT, "No such file", str(folder / "new" / "x"))
    with pytest.raises(FileNotFoundError), report_user_errors("train"):
        raise error
    folder.rmdir()  # somebody deleted all of it: no defect of ours
    said(Mock(side_effect=error), capsys)


def test_real_paths(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("1")
    (tmp_path / "loop").symlink_to("loop")
    for name in ("file/x/a.json", "loop/a.json", f"{'n' * 300}/a.json", "a" * 300):
        assert "remedy" in said(partial(write_text, tmp_path / name, "1"), capsys)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: np.zeros(1 << 60, np.uint8), "not enough memory"),
        (lambda: torch.zeros(1 << 59, dtype=torch.uint8), "not enough memory"),
        (lambda: json.loads("[" * 20_000), "nested too deeply"),
        (lambda: yaml.safe_load("[" * 20_000), "nested too deeply"),
    ],
)
def test_too_little_memory_and_deep_nesting_are_no_defects_of_ours(
    call: Callable[[], object], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = said(call, capsys)
    assert words in text and "remedy" in text


def test_ctrl_c_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(said(Mock(side_effect=KeyboardInterrupt), capsys, 130).strip().splitlines()) == 1


SLEEPS = """
import sys, time
from pathlib import Path
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import atomic_folder
with report_user_errors("train"), atomic_folder(Path(sys.argv[1])) as temporary:
    (temporary / "half").write_text("1")
    print("ready", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_signals_end_with_one_line_and_without_leftovers(
    number: signal.Signals, status: int, tmp_path: Path, project_root: Path
) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", SLEEPS, str(tmp_path / "out")],
        env={**os.environ, "PYTHONPATH": str(project_root)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=partial(signal.signal, number, signal.SIG_DFL),  # a shell's background jobs ignore some of them
    )
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == status, errors
    assert len(errors.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_nobody_reads_any_more_is_no_error(project_root: Path) -> None:
    code = "from facefolds_core.errors import UserError, report_user_errors\nwith report_user_errors('x'):\n"
    code += "    for _ in range(100000): print('line', flush=True)"
    done = subprocess.run(
        ["bash", "-c", f'{sys.executable} -c "$0" | head -1', code],
        env={**os.environ, "PYTHONPATH": str(project_root)},
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == ("line\n", "")
