"""A short run of the fuzzer of the player's server: `python -m tests.hostile --only server` makes a long one."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile import fuzz_server

pytestmark = pytest.mark.slow


def test_broken_requests_harm_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    counts = fuzz_server.run(100, 1, tmp_path)
    assert counts.tried == 100 and counts.refused > 40
    assert counts.defects == []
    assert "Traceback" not in "".join(capfd.readouterr())
