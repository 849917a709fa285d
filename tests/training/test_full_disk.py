"""A full disk while training: an error of the disk like every other."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
import torch

from facefolds_core.errors import UserError
from facefolds_core.model.tensor_files import write_tensors
from facefolds_core.training.log import log_metrics, open_log
from facefolds_core.training.segments.forecast import check_space
from tests.hostile.fuzz_disk import limited_files


def test_safetensors_has_the_mode_of_every_other_file_and_fails_like_it(tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    write_tensors(path, {"a": torch.zeros(3)}, {})
    (tmp_path / "other").touch()
    assert path.stat().st_mode == (tmp_path / "other").stat().st_mode
    before = path.read_bytes()
    with pytest.raises(OSError) as caught, limited_files(1000):
        write_tensors(path, {"a": torch.zeros(10_000)}, {})
    assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(path))
    assert path.read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {path.name, "other"}


def test_a_model_that_would_not_fit_is_not_trained(tmp_path: Path) -> None:
    check_space(tmp_path / "not" / "there", 1000)
    with pytest.raises(UserError, match="would not fit") as caught:
        check_space(tmp_path / "not" / "there", 1 << 60)
    assert "MB" in str(caught.value)


def test_a_log_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with open_log(tmp_path / "training") as live:
        log_metrics(live, 1, {"psnr": 20.0})
        with limited_files(10), pytest.raises(UserError, match="larger than is allowed") as caught:
            live.make_summary()
    assert str(tmp_path / "training") in str(caught.value)
