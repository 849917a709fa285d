"""The benchmarks stay small: what makes documents is docs/tools, what proves is tests."""

from __future__ import annotations

from pathlib import Path

MOST = 3247
"""Lines of Python. The aim is 2200: lower it with them, never raise it but for a new command that an issue asks for:
`gate`, 220 lines, which took over from `rooms`, `large`, 88 (2400 before them), `start`, 134, `equal_bytes`, 191,
`worth`, 230, when `decode`, 54, went, and `gpu`, 65."""


def test_the_benchmarks_stay_small(project_root: Path) -> None:
    lines = {
        path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in (project_root / "bench").glob("*.py")
    }
    assert sum(lines.values()) <= MOST, lines
