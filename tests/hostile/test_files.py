"""A short run of the fuzzer of files between stages; the long one is `python -m tests.hostile --only files`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.fuzz_files import KINDS, run

pytestmark = pytest.mark.slow


def test_damaged_files_are_refused_or_harmless(tmp_path: Path) -> None:
    counts = run(12 * len(KINDS), 11, tmp_path)
    assert counts.defects == []
    assert (counts.tried, counts.refused > 5) == (12 * len(KINDS), True)
