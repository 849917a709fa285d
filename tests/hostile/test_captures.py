"""A short run of the fuzzer of captures; the long one is `python -m tests.hostile --only captures`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.fuzz_captures import run

pytestmark = pytest.mark.slow


def test_damaged_captures_are_refused_or_harmless(tmp_path: Path) -> None:
    counts = run(60, 11, tmp_path)
    assert counts.defects == []
    assert (counts.tried, min(counts.accepted, counts.refused) > 5) == (60, True)
