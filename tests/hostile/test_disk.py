"""Every stage on a disk without room (many cases: `python -m tests.hostile --only disk --count 500`)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.fuzz_disk import STAGES, NoSmallDiskError, run, small_disk

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("rounds", [1, pytest.param(3, marks=pytest.mark.nightly)])
def test_no_stage_loses_anything_for_want_of_room(rounds: int, tmp_path: Path) -> None:
    counts = run(rounds * len(STAGES), 0, tmp_path)
    assert counts.tried == rounds * len(STAGES)
    assert counts.refused > rounds * len(STAGES) / 4
    assert counts.defects == []


def test_full_disks_were_among_them(tmp_path: Path) -> None:
    try:
        with small_disk(tmp_path / "disk"):
            pass
    except NoSmallDiskError as error:
        pytest.skip(f"{error}: the test above knew limits of file sizes only")
