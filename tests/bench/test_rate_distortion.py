"""The arithmetic of the rate-distortion tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.rate_distortion import Point, bytes_at, draw, psnr_at, quality_table, size_table

PAPER = [Point("paper", crf, 1000, size, db) for crf, size, db in ((14, 9000, 30.0), (22, 3000, 28.0), (30, 0, 25.0))]
OURS = [Point("ours", crf, 100, size, db) for crf, size, db in ((14, 3900, 30.5), (22, 900, 28.0))]


def test_bytes_are_interpolated_in_their_logarithm() -> None:
    assert bytes_at(29.0, PAPER) == pytest.approx((4000 * 10000) ** 0.5)
    assert bytes_at(28.0, PAPER) == pytest.approx(4000)
    assert bytes_at(31.0, PAPER) is None
    assert bytes_at(24.0, PAPER) is None


def test_table_has_a_row_for_each_quality_of_the_paper() -> None:
    lines = size_table(PAPER + OURS).splitlines()
    assert lines[0] == "| held-out PSNR | paper | ours |"
    assert lines[3] == "| 28.00 dB | 4 kB | 1 kB |"
    assert lines[4] == "| 25.00 dB | 1 kB | at most 1 kB |"


def test_quality_at_bytes_is_the_way_back() -> None:
    assert psnr_at(round((4000 * 10000) ** 0.5), PAPER) == pytest.approx(29.0, abs=1e-3)
    assert psnr_at(20_000, PAPER) is None
    assert quality_table(PAPER + OURS).splitlines()[3:] == [
        "| 4 kB | 28.00 dB | 30.50 dB |",
        "| 1 kB | 25.00 dB | 28.00 dB |",
    ]


def test_chart_is_written(tmp_path: Path) -> None:
    draw(PAPER + OURS, tmp_path / "chart.png", "x")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")
