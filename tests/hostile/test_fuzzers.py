"""Short runs of the fuzzers: `python -m tests.hostile` makes long ones (`--only disk --count 500`)."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from tests.hostile import fuzz_kills, fuzz_params
from tests.hostile.fuzz_disk import STAGES, NoSmallDiskError, run, small_disk

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "count", "seed", "refused", "accepted"),
    [
        ("assets", 60, 1, 40, 0),
        ("captures", 60, 11, 5, 6),
        ("files", 144, 11, 5, 0),
        ("params", 80, 1, 40, 3),
        ("server", 100, 1, 40, 0),
    ],
)
def test_damage_is_refused_in_words_or_harmless(
    name: str, count: int, seed: int, refused: int, accepted: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    counts = importlib.import_module(f"tests.hostile.fuzz_{name}").run(count, seed, tmp_path)
    assert counts.defects == []
    assert counts.tried == count and counts.refused > refused and counts.accepted >= accepted
    assert "Traceback" not in "".join(capfd.readouterr())


def test_crashes_and_harm_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz_params, "load_params", lambda _: {}["nothing"])
    assert fuzz_params.run(4, 1, tmp_path / "crash").crashed
    kept = tmp_path / "harm" / "precious" / "config" / "kept.txt"
    monkeypatch.setattr(fuzz_params, "load_params", lambda _: kept.unlink())
    assert fuzz_params.run(1, 1, tmp_path / "harm").harmed


@pytest.mark.parametrize("rounds", [1, pytest.param(3, marks=pytest.mark.nightly)])
def test_no_stage_loses_anything_for_want_of_room(rounds: int, tmp_path: Path) -> None:
    counts = run(rounds * len(STAGES), 0, tmp_path)
    assert counts.tried == rounds * len(STAGES) and counts.refused > counts.tried / 4
    assert counts.defects == []


def test_full_disks_were_among_them(tmp_path: Path) -> None:
    try:
        with small_disk(tmp_path / "disk"):
            pass
    except NoSmallDiskError as error:
        pytest.skip(f"{error}: the test above knew limits of file sizes only")


@pytest.mark.nightly
def test_killed_runs_are_recovered(tmp_path: Path) -> None:
    counts = fuzz_kills.run(2, 0, tmp_path)
    assert (counts.tried, counts.defects) == (2, [])
