"""The chart: the frontier, what is drawn of the records, and that files come out."""

import json
from pathlib import Path

import pytest

from bench.chart import chart_data, draw, write_plot_data
from bench.results import Conditions, Measurement, Scores
from facefolds_core.errors import UserError


def measurement(preset: str, seconds: float, psnr: float, **values: object) -> Measurement:
    conditions = {"commit": "aaa", "clock": "wall", "threads": 2, "machine": "one", "frames": 3}
    conditions |= {key: values.pop(key) for key in list(values) if key in conditions}
    return Measurement(
        **{
            "subject": "actor",
            "preset": preset,
            "budget": seconds,
            "seconds": seconds,
            "iterations": round(10 * seconds),
            "peak_memory_bytes": 1 << 30,
            "scores": Scores(region="subject", images=6, psnr=psnr, ssim=0.8, lpips=None, st_lpips=0.2),
            "date": "2026-01-01T00:00:00+00:00",
            "conditions": Conditions.model_validate(conditions),
            **values,
        }
    )


def test_the_newest_point_of_each_budget_is_drawn_on_one_clock() -> None:
    newer = {"commit": "bbb", "date": "2026-01-02T00:00:00+00:00"}
    measurements = [
        measurement("fast", 10, 20.0),
        measurement("fast", 30, 21.0),
        measurement("fast", 11, 22.0, budget=10, **newer),
        measurement("quick", 10, 18.0),
        measurement("quick", 10, 17.0, clock="processor"),
        measurement("quick", 10, 5.0, variant="seed 1"),
        measurement("paper", 60, 9.0, scores=None, failure="diverged"),
    ]
    drawn = [(m.preset, m.seconds, m.scores.psnr) for m in chart_data(measurements) if m.scores]
    assert drawn == [("fast", 11, 22.0), ("fast", 30, 21.0), ("quick", 10, 18.0)]


def test_budgets_that_one_step_passes_are_one_point() -> None:
    one_step = [measurement("paper", 18, 9.0, budget=b, iterations=1) for b in (10, 15)]
    assert len(chart_data(one_step)) == 1


def test_a_picture_and_plot_data_come_out(tmp_path: Path) -> None:
    measurements = [
        measurement(preset, seconds, psnr + seconds / 100, subject=subject)
        for subject in ("actor", "mugsy")
        for preset, psnr in (("fast", 26.0), ("quick", 24.0), ("other", 10.0))
        for seconds in (10.0, 60.0)
    ]
    draw(measurements, tmp_path / "chart.png")
    write_plot_data(measurements, tmp_path / "plot.json")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")
    rows = json.loads((tmp_path / "plot.json").read_text())
    assert len(rows) == 12 and {row["preset"] for row in rows if row["frontier"]} == {"fast"}
    assert all("lpips" not in row and row["st_lpips"] == 0.2 for row in rows)


def test_nothing_to_draw(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing measured"):
        draw([], tmp_path / "chart.png")
