"""The log of a training on a disk that takes no more."""

from pathlib import Path

import pytest

from facefolds_core.errors import UserError
from facefolds_core.training.log import log_metrics, open_log
from tests.hostile.fuzz_disk import limited_files


def test_a_log_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with open_log(tmp_path / "training") as live:
        log_metrics(live, 1, {"psnr": 20.0})
        with limited_files(10), pytest.raises(UserError, match="larger than is allowed") as caught:
            live.make_summary()
    assert str(tmp_path / "training") in str(caught.value)
