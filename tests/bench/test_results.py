"""Stores of measurements: what replaces what, what is refused, and that all that is kept can be read and drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bench import charts
from bench.results import ROOT, Cell, Conditions, Measurement, Row, Scores, Store, commit_name
from bench.tables import AXES, RATES, hazard_tables, rate_tables
from facefolds_core.errors import UserError

KEPT = ROOT / "bench" / "results"
CONDITIONS = Conditions(commit="aaa", clock="wall", threads=2, machine="one", frames=3)


def measurement(iterations: int, seconds: float, psnr: float | None = None, **values: object) -> Measurement:
    scores = psnr and Scores(region="subject", images=6, psnr=psnr, ssim=0.8, lpips=None, st_lpips=0.2)
    given = {"subject": "actor", "preset": "fast", "conditions": CONDITIONS, "date": "2026-01-01", **values}
    return Measurement.model_validate({"iterations": iterations, "seconds": seconds, "scores": scores, **given})


def test_a_measurement_replaces_the_same_one_only(tmp_path: Path) -> None:
    store = Store(tmp_path / "new" / "results.json", "measurements", Measurement)
    other = CONDITIONS.model_copy(update={"commit": "bbb"})
    first, elsewhere = [measurement(5, 10.4), measurement(7, 30.1)], measurement(5, 9.0, conditions=other)
    for one in (*first, elsewhere, measurement(5, 10.2)):
        store.add(one)
    assert [m.seconds for m in store.read()] == [30.1, 9.0, 10.2]


@pytest.mark.parametrize("text", ["{", '{"version": 9}', '{"version": 1, "measurements": [{"subject": 1}]}', "[]"])
def test_a_garbled_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "results.json"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        Store(path, "measurements", Measurement).read()
    assert caught.value.file == path and "git checkout" in str(caught.value.remedy)


def test_a_folder_outside_git_has_no_commit(tmp_path: Path) -> None:
    assert commit_name(tmp_path) == "unknown"


def test_the_newest_of_each_is_drawn_on_one_clock() -> None:
    processor = CONDITIONS.model_copy(update={"clock": "processor"})
    first, later = measurement(100, 10, 20.0, budget=10), measurement(120, 11, 22.0, budget=10, date="2026-01-02")
    others = measurement(40, 10, 17.0, conditions=processor), measurement(60, 9, None, failure="diverged")
    found = charts.newest([first, later, measurement(300, 30, 21.0), *others])
    assert [(m.seconds, m.scores.psnr) for m in found if m.scores] == [(11, 22.0), (30, 21.0)]


def film() -> list[Cell]:
    return [cell for cell in Store(KEPT / "hazards.json", "cells", Cell).read() if cell.subject == "film"]


def rows() -> list[Row]:
    return Store(KEPT / "sweeps.json", "rows", Row).read()


def rates() -> list[Row]:
    return [row for row in rows() if row.sweep in RATES]


@pytest.mark.parametrize(
    ("draw", "kept"),
    [
        (charts.speed, lambda: Store(KEPT / "speed_accuracy.json", "measurements", Measurement).read()),
        (charts.hazards, film),
        (charts.sweeps, lambda: [row for row in rows() if row.sweep in AXES]),
        (lambda kept, path: charts.rate(kept, path, "actor"), rates),
    ],
    ids=["speed", "hazards", "sweeps", "rate"],
)
def test_all_that_is_kept_is_drawn(draw: Callable[..., None], kept: Callable[[], object], tmp_path: Path) -> None:
    draw(kept(), tmp_path / "chart.png")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")


def test_figures_that_stand_in_the_docs_are_those_that_are_kept() -> None:
    assert "|fewer cameras|16 of 22: 0.2|8 of 22: 3.2|" in hazard_tables(film())
    assert "| 24.23 dB | 882 kB | 351 kB | 324 kB | 308 kB | 235 kB |" in rate_tables(rates())


def test_nothing_to_draw(tmp_path: Path) -> None:
    for draw in (charts.speed, charts.sweeps):
        with pytest.raises(UserError, match="nothing measured"):
            draw([], tmp_path / "chart.png")
