"""A few kills (many: `python -m tests.hostile --only kills --count 60`, of long takes `--only takes --count 20`)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile import fuzz_takes
from tests.hostile.fuzz_kills import run

pytestmark = pytest.mark.slow


def test_killed_runs_are_recovered(tmp_path: Path) -> None:
    counts = run(3, 0, tmp_path)
    assert counts.tried == 3
    assert counts.defects == []


@pytest.mark.nightly  # tests/training/test_segments.py ends a training of a take between two frames
def test_killed_trainings_of_takes_end_as_if_never_killed(tmp_path: Path) -> None:
    counts = fuzz_takes.run(4, 0, tmp_path)
    assert counts.tried == 4 and counts.accepted
    assert counts.defects == []
