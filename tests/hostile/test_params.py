"""A short run of the fuzzer of params.yaml, and that it can find something."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile import fuzz_params

pytestmark = pytest.mark.slow


def test_nothing_crashes_or_leads_elsewhere(tmp_path: Path) -> None:
    counts = fuzz_params.run(80, 1, tmp_path)
    assert counts.tried == 80 and counts.refused > 40 and counts.accepted > 2
    assert not counts.defects


def test_it_finds_a_crash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz_params, "load_params", lambda _: {}["nothing"])
    assert fuzz_params.run(4, 1, tmp_path).crashed


def test_it_finds_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz_params, "load_params", lambda _: (tmp_path / "precious" / "config" / "kept.txt").unlink())
    assert fuzz_params.run(1, 1, tmp_path).harmed
