"""The file of measurements, and what it lets a second run skip."""

from functools import partial
from pathlib import Path

import pytest

from bench import speed_accuracy
from bench.common import find_scenes, keep, numbers
from bench.results import Conditions, Measurement, Results, describe
from bench.runs import Job
from bench.speed_accuracy import measure, next_iterations
from facefolds_core.errors import UserError
from facefolds_core.params import train_params

CONDITIONS = Conditions(commit="aaa", clock="wall", threads=2, machine="one", frames=3)


def job(tmp_path: Path, preset: str, **conditions: object) -> Job:
    own = CONDITIONS.model_copy(update=conditions)
    return Job("actor", tmp_path, train_params({"preset": preset}), "", own, tmp_path / "scratch")


def test_a_measurement_replaces_the_same_one_only(tmp_path: Path) -> None:
    results = Results(tmp_path / "results.json")
    one = job(tmp_path, "quick")
    for seconds in (10.4, 10.2):
        results.add(one.measurement(10.0, seconds, 5, 1 << 20, None))
    results.add(one.measurement(30.0, 30.1, 5, 1 << 20, None))
    results.add(job(tmp_path, "quick", commit="bbb").measurement(10.0, 9.0, 5, 1 << 20, None))
    assert [m.seconds for m in results.read()] == [10.2, 30.1, 9.0]


@pytest.mark.parametrize("text", ["{", '{"version": 9}', '{"version": 1, "measurements": [{"subject": 1}]}', "[]"])
def test_a_garbled_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "results.json"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        Results(path).read()
    assert caught.value.file == path and "git checkout" in str(caught.value.remedy)


def test_only_what_is_missing_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = Results(tmp_path / "results.json")
    asked: list[list[float]] = []

    def fake(function: object, one: Job, budgets: list[float], record: partial[None]) -> None:
        asked.append(budgets)
        for budget in budgets:
            record(one.measurement(budget, budget, 1, 1, None))

    monkeypatch.setattr(speed_accuracy, "in_a_process", fake)
    measure(job(tmp_path, "quick"), [10.0, 30.0], results, force=False)
    measure(job(tmp_path, "quick"), [10.0, 30.0], results, force=False)
    measure(job(tmp_path, "quick"), [10.0, 60.0], results, force=False)
    measure(job(tmp_path, "quick", commit="bbb"), [10.0], results, force=False)
    measure(job(tmp_path, "quick"), [10.0], results, force=True)
    assert asked == [[10.0, 30.0], [60.0], [10.0], [10.0]]


def test_explicit_runs_are_sized_by_those_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = Results(tmp_path / "results.json")
    runs: list[int] = []

    def fake(function: object, one: Job, budget: float, record: partial[None]) -> Measurement:
        runs.append(one.params.iterations)
        made = one.measurement(budget, 0.5 + 0.05 * one.params.iterations, one.params.iterations, 1, None)
        record(made)
        return made

    monkeypatch.setattr(speed_accuracy, "in_a_process", fake)
    measure(job(tmp_path, "fast"), [10.0, 30.0, 120.0], results, force=False)
    seconds = [m.seconds for m in results.read()]
    assert seconds == pytest.approx([10, 30, 120], rel=speed_accuracy.NEAR)
    assert len(runs) <= 1 + 2 * 3


def test_iterations_follow_the_line_through_the_last_run() -> None:
    assert next_iterations(30.0, [], 460) == 460
    assert next_iterations(30.0, [(100, 10.0)], 460) == 300
    assert next_iterations(60.0, [(900, 500.0), (100, 15.0), (300, 25.0)], 460) == 1000
    assert next_iterations(1.0, [(100, 15.0), (300, 25.0)], 460) == 1
    assert next_iterations(30.0, [(100, 15.0), (300, 10.0)], 460) == 900  # noise: no line falls


def test_records_tell_what_happened(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    failed = job(tmp_path, "paper").measurement(10.0, 3.0, 0, 1 << 30, None, "training diverged")
    keep(tmp_path / "results.json", failed)
    assert "actor, paper: failed after 3.0 s (0 iterations, 1.00 GiB): training diverged" in capsys.readouterr().out
    assert describe(failed).endswith("diverged")


def test_a_missing_scene_is_reported_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no prepared scene of actor") as caught:
        find_scenes([], tmp_path)
    assert "dvc repro normalize@actor" in str(caught.value.remedy)
    (tmp_path / "mugsy" / "scene").mkdir(parents=True)
    (tmp_path / "mugsy" / "scene" / "scene.json").write_text("{}")
    assert list(find_scenes([], tmp_path)) == ["mugsy"]


@pytest.mark.parametrize("text", ["", "10,", "0,10", "-3", "ten"])
def test_seconds_that_are_none(text: str) -> None:
    with pytest.raises(UserError, match="seconds"):
        numbers(text, "--seconds")
