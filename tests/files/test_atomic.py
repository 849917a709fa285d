"""Whole files and folders only: what lies beside is left alone, kills at every step are recovered from."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import av
import pytest

from facefolds_core.errors import UserError
from facefolds_core.files.writing import MARK, PREFIX, atomic_file, atomic_folder, clear_temporaries, write_text
from tests.processes import printed


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_what_lies_beside_the_target_is_left_alone(tmp_path: Path) -> None:
    kept = [".mygame-settings", ".mygame-abcdefgh", f"{PREFIX}settings"]
    for name in kept:
        (tmp_path / name).mkdir()
        (tmp_path / name / "precious").write_text("1")
    with atomic_folder(tmp_path / "mygame") as temporary:
        (temporary / "x").write_text("1")
    assert {name: names(tmp_path / name) for name in names(tmp_path)} == {
        **{name: ["precious"] for name in kept},
        "mygame": ["x"],
    }


def test_what_another_process_writes_is_left_alone(tmp_path: Path) -> None:
    with atomic_folder(tmp_path / "a") as first:
        (first / "x").write_text("1")
        with atomic_folder(tmp_path / "b") as second:
            (second / "y").write_text("2")
        assert names(first) == ["x"]
    assert names(tmp_path) == ["a", "b"]


@pytest.mark.parametrize("atomic", [atomic_file, atomic_folder])
def test_a_failure_leaves_the_old_one_and_nothing_beside(tmp_path: Path, atomic: Callable[[Path], Any]) -> None:
    def write(text: str) -> None:
        with atomic(tmp_path / "a") as temporary:
            (temporary if atomic is atomic_file else temporary / "x").write_text(text)
            if text == "half":
                raise RuntimeError

    write("old")
    with pytest.raises(RuntimeError):
        write("half")
    assert names(tmp_path) == ["a"]
    assert [path.read_text() for path in tmp_path.rglob("*") if path.is_file()] == ["old"]


KILLS = """
import os, signal, sys
from pathlib import Path
from facefolds_core.files.writing import PREFIX, atomic_file, atomic_folder, clear_temporaries

STEPS = {"os.rename", "os.mkdir", "os.rmdir", "os.remove", "open", "shutil.rmtree", "os.chmod"}
root, kind = Path(sys.argv[1]), sys.argv[2]

def write():
    if kind == "file":
        with atomic_file(target) as temporary:
            temporary.write_text("new")
        return
    with atomic_folder(target) as temporary:
        for name in "ab":
            (temporary / name).write_text("new")

def killer(step):
    left = [step]
    def hook(event, _):
        if event in STEPS:
            left[0] -= 1
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)
    return hook

outcomes = set()
for step in range(1000):
    target = root / str(step) / "target"
    target.parent.mkdir()
    if kind == "file":
        target.write_text("old")
    else:
        target.mkdir()
        for name in "ab":
            (target / name).write_text("old")
    child = os.fork()
    if child == 0:
        sys.addaudithook(killer(step))
        write()
        os._exit(0)
    ended = os.waitpid(child, 0)[1] == 0
    clear_temporaries(target.parent)
    found = [p.name for p in target.parent.iterdir()]
    assert found == ["target"], (step, found)
    files = [target] if kind == "file" else sorted(target.iterdir())
    assert kind == "file" or [p.name for p in files] == ["a", "b"], (step, files)
    contents = {p.read_text() for p in files}
    assert contents in ({"old"}, {"new"}), (step, contents)
    outcomes |= contents
    if ended:
        break
assert step > 8 and outcomes == {"old", "new"}, (step, outcomes)
"""


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_kill_at_any_step_leaves_a_whole_old_or_new_one(kind: str, tmp_path: Path) -> None:
    printed(KILLS, str(tmp_path), kind)


def test_a_failure_to_move_in_puts_the_old_folder_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "out"
    target.mkdir()
    (target / "old").write_text("1")
    replace = Path.replace

    def failing(self: Path, to: Path) -> Path:
        if self.parent.name == "new":
            raise OSError(errno.ENOSPC, "No space left on device")
        return replace(self, to)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises(OSError), atomic_folder(target) as temporary:
        (temporary / "new").write_text("2")
    assert (names(tmp_path), names(target)) == (["out"], ["old"])


def test_what_cannot_be_put_back_is_not_deleted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    left = tmp_path / f"{PREFIX}abcdefgh"
    (left / "old" / "out").mkdir(parents=True)
    (left / "old" / "out" / "x").write_text("1")
    (left / MARK).touch()

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", Mock(side_effect=OSError(errno.EACCES, "Permission denied")))
        clear_temporaries(tmp_path)
    assert (left / "old" / "out" / "x").exists() and (left / MARK).exists()
    clear_temporaries(tmp_path)
    assert (names(tmp_path), names(tmp_path / "out")) == (["out"], ["x"])


def test_folders_that_must_not_be_replaced_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = tmp_path / "project" / "below"
    work.mkdir(parents=True)
    (work / "precious").write_text("1")
    monkeypatch.chdir(work)
    (tmp_path / "file").write_text("1")
    (tmp_path / "link").symlink_to(work, target_is_directory=True)
    (tmp_path / "nowhere").symlink_to(tmp_path / "none")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for target in (".", "..", work, work.parent, tmp_path, "/", *(tmp_path / n for n in ("file", "link", "loop"))):
        with pytest.raises(UserError, match="not one that can be"), atomic_folder(target) as temporary:
            (temporary / "x").write_text("1")
    with pytest.raises(UserError, match="a link to"), atomic_folder(tmp_path / "nowhere"):
        pass
    assert names(work) == ["precious"]
    assert names(tmp_path) == ["file", "link", "loop", "nowhere", "project"]


@pytest.mark.skipif(not Path("/proc").is_mount(), reason="no /proc that is a mount point (needs Linux)")
def test_a_mount_point_is_refused() -> None:
    with pytest.raises(UserError, match="a mount point"), atomic_folder("/proc"):
        pass


def test_files_that_must_not_be_replaced_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "null").symlink_to("/dev/null")
    for name in ("pipe", "folder", "null"):
        with pytest.raises(UserError, match="something else lies"):
            write_text(tmp_path / name, "1")
    assert names(tmp_path) == ["folder", "null", "pipe"]


def test_the_umask_decides_on_modes(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "a.txt", "1")
        with atomic_file(tmp_path / "b.txt") as temporary:
            temporary.unlink()
            temporary.write_text("1")
            temporary.chmod(0o600)
        with atomic_folder(tmp_path / "c"):
            pass
    finally:
        os.umask(before)
    modes = [(tmp_path / name).stat().st_mode & 0o777 for name in ("a.txt", "b.txt", "c")]
    assert modes == [0o640, 0o640, 0o750]


def test_errors_name_the_file_that_was_to_be(tmp_path: Path) -> None:
    asset = tmp_path / "asset"
    with pytest.raises(OSError) as unnamed, atomic_folder(asset):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert unnamed.value.filename == str(asset)
    with pytest.raises(OSError) as inside, atomic_folder(asset) as made, atomic_file(made / "sub" / "a.jpg") as file:
        raise OSError(errno.ENOSPC, "No space left on device", str(file))
    assert inside.value.filename == str(asset / "sub" / "a.jpg")
    with pytest.raises(OSError) as pyav, atomic_folder(asset) as made:
        raise av.error.OSError(errno.EFBIG, "File too large", str(made / "films" / "000.mp4"))
    assert (pyav.value.errno, pyav.value.filename) == (errno.EFBIG, str(asset / "films" / "000.mp4"))
    with pytest.raises(UserError) as users, atomic_folder(asset) as made:
        raise UserError("bad", file=made / "full.mp4")
    assert users.value.file == asset / "full.mp4"
    assert names(tmp_path) == []
