"""A short run of the fuzzer of assets: `python -m tests.hostile --only assets` makes a long one."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile import fuzz_assets

pytestmark = pytest.mark.slow


def test_damaged_assets_are_refused_in_words(tmp_path: Path) -> None:
    counts = fuzz_assets.run(60, 1, tmp_path)
    assert counts.tried == 60 and counts.refused > 40
    assert counts.defects == []
