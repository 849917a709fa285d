"""A few kills (many: `python -m tests.hostile --only kills --count 60`)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.fuzz_kills import run

pytestmark = [pytest.mark.slow, pytest.mark.nightly]


def test_killed_runs_are_recovered(tmp_path: Path) -> None:
    counts = run(2, 0, tmp_path)
    assert counts.tried == 2
    assert counts.defects == []
