"""A full disk while training: an error of the disk like every other, and what was trained is not lost."""

from __future__ import annotations

import errno
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from facefolds_core.errors import UserError
from facefolds_core.model.tensor_files import write_tensors
from facefolds_core.training import patience
from facefolds_core.training.log import log_metrics, open_log
from facefolds_core.training.patience import check_space, patiently
from tests.hostile.fuzz_disk import limited_files


def failing(times: int, number: int = errno.ENOSPC) -> tuple[list[int], Callable[[], str]]:
    calls: list[int] = []

    def write() -> str:
        calls.append(1)
        if len(calls) <= times:
            raise OSError(number, "No space left on device", "data/x/model")
        return "written"

    return calls, write


def test_safetensors_fails_like_every_other_file(tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    write_tensors(path, {"a": torch.zeros(3)}, {})
    before = path.read_bytes()
    with pytest.raises(OSError) as caught, limited_files(1000):
        write_tensors(path, {"a": torch.zeros(10_000)}, {})
    assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(path))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_safetensors_gets_the_mode_of_every_other_file(tmp_path: Path) -> None:
    write_tensors(tmp_path / "a.safetensors", {"a": torch.zeros(3)}, {})
    (tmp_path / "b").touch()
    assert (tmp_path / "a.safetensors").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_a_full_disk_is_waited_for(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(patience, "EVERY", 0.0)
    calls, write = failing(3)
    assert patiently(write) == "written"
    assert len(calls) == 4
    said = capsys.readouterr().err
    assert said.count("data/x/model") == 1 and "free some space" in said


def test_not_for_ever_and_not_for_other_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patience, "EVERY", 0.0)
    calls, write = failing(3, errno.EACCES)
    with pytest.raises(PermissionError):
        patiently(write)
    assert len(calls) == 1
    monkeypatch.setattr(patience, "SECONDS", 0.0)
    calls, write = failing(3)
    with pytest.raises(OSError):
        patiently(write)
    assert len(calls) == 1


def test_a_model_that_would_not_fit_is_not_trained(tmp_path: Path) -> None:
    check_space(tmp_path / "not" / "there", 1000)
    with pytest.raises(UserError, match="would not fit") as caught:
        check_space(tmp_path / "not" / "there", 1 << 60)
    assert "MB" in str(caught.value)


def test_the_log_has_no_half_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patience, "SECONDS", 0.0)
    path = tmp_path / "log" / "plots" / "metrics" / "psnr.tsv"
    with open_log(tmp_path / "log") as live:
        for size in (0, 3):  # nothing, and a part of the header
            with pytest.raises(OSError) as caught, limited_files(size):
                log_metrics(live, 1, {"psnr": 1.5})
            assert caught.value.filename == str(path)
            assert not path.exists()
        log_metrics(live, 1, {"psnr": 1.5})
        before = path.read_text()
        with pytest.raises(OSError), limited_files(len(before) + 2):
            log_metrics(live, 2, {"psnr": 2.5})
        assert path.read_text() == before
        log_metrics(live, 2, {"psnr": 2.5})
    assert path.read_text() == "step\tpsnr\n1\t1.5\n2\t2.5\n"


def test_a_summary_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with open_log(tmp_path / "log") as live:
        live.summary["psnr"] = 30.0
        for end in (live.make_summary, live.sync):
            with pytest.raises(OSError) as caught, limited_files(3):
                end()
            assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(tmp_path / "log" / "metrics.json"))
