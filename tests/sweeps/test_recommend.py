"""Recommendations from tables whose answer can be read off."""

from __future__ import annotations

import pytest

from facefolds_core.errors import UserError
from facefolds_core.sweeps.recommend import INDIFFERENT, Budget, judged_by, recommend
from facefolds_core.sweeps.table import Run


def run(name: str, size: float, psnr: float, triangles: float = 1000.0, **figures: float) -> Run:
    return Run(
        name, "actor", figures={"bytes": size, "psnr_subject": psnr, "psnr": 1.0, "triangles": triangles, **figures}
    )


RUNS = [
    run("huge", 9000, 30.02, 90000),
    run("large", 4000, 30.0, 40000),
    run("bad", 3000, 20.0, 500),
    run("medium", 2000, 28.0, 9000, gpu_bytes=500, video_bits_per_second=100),
    run("small", 1000, 25.0, 2000, gpu_bytes=400, video_bits_per_second=200),
    Run("failed", "actor", error="out of memory"),
]


@pytest.mark.parametrize(
    ("budget", "psnr", "name"),
    [
        (Budget(bytes=3500), None, "medium"),
        (Budget(bytes=2000), None, "medium"),
        (Budget(triangles=5000), None, "small"),
        (Budget(triangles=600), None, "bad"),
        (Budget(gpu_bytes=450), None, "small"),
        (Budget(video_bits_per_second=150), None, "medium"),
        (Budget(), 27.0, "medium"),
        (Budget(), 28.0, "medium"),
        (Budget(), 30.01, "huge"),
        (Budget(triangles=50000), 26.0, "medium"),
    ],
)
def test_the_answer_can_be_read_off(budget: Budget, psnr: float | None, name: str) -> None:
    assert recommend(RUNS, budget, psnr).experiment == name


def test_twice_the_bytes_for_nothing_visible_are_not_spent() -> None:
    assert recommend(RUNS, Budget(bytes=1e6)).experiment == "large"
    finer = [*RUNS, run("visible", 9000, 30.0 + 1.1 * INDIFFERENT)]
    assert recommend(finer, Budget(bytes=1e6)).experiment == "visible"


def test_the_whole_frame_tells_nothing() -> None:
    runs = [Run(n, "x", figures={"bytes": b, "psnr": db}) for n, b, db in (("a", 1.0, 20.0), ("b", 2.0, 22.0))]
    with pytest.raises(UserError, match="cannot be told apart") as error:
        recommend(runs, Budget(), 21.0)
    assert "masks" in str(error.value.expected)


def test_cameras_for_validation_come_before_held_out_ones() -> None:
    runs = [run("lucky", 10, 30.0, validate_psnr_subject=25.0), run("good", 10, 29.0, validate_psnr_subject=26.0)]
    assert judged_by(runs) == "validate_psnr_subject"
    assert recommend(runs, Budget(bytes=100)).experiment == "good"


def test_runs_are_compared_by_what_all_of_them_have() -> None:
    runs = [run("a", 10, 30.0, validate_psnr_subject=25.0), run("b", 10, 29.0), RUNS[-1]]
    assert judged_by(runs) == "psnr_subject"


@pytest.mark.parametrize(
    ("runs", "budget", "psnr", "says"),
    [
        (RUNS, Budget(), None, "neither a budget nor a quality"),
        (RUNS[-1:], Budget(bytes=1), None, "nothing measured"),
        (RUNS, Budget(bytes=999), None, r"(?s)within the budget.*bytes 1000 at least \(small\)"),
        (RUNS, Budget(), 31.0, r"(?s)good enough\n.*31.00 dB.*at most 30.02 dB \(huge"),
        (RUNS, Budget(triangles=5000), 26.0, r"(?s)good enough within the budget.*at most 25.00 dB \(small"),
    ],
)
def test_what_cannot_be_had_is_said(runs: list[Run], budget: Budget, psnr: float | None, says: str) -> None:
    with pytest.raises(UserError, match=says):
        recommend(runs, budget, psnr)
