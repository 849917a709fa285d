"""Runs on a scene of spheres: what is recorded, scores as `evaluate` has them, interruption."""

from pathlib import Path

import pytest

from bench import runs
from bench.clock import Clock
from bench.results import Conditions, Measurement
from bench.runs import Job, measure_on_the_way, measure_whole, score
from facefolds_core.captures.scene import Scene
from facefolds_core.model import load_model
from facefolds_core.params import TrainParams, train_params
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.training.loop import train, train_step
from facefolds_core.training.report import TrainingReport
from tests.scenes import OPAQUE, make_scene

TINY = {
    "preset": "quick", "layers": 2, "manifold_layers": 1, "manifold_width": 8, "texture_layers": 1, "texture_width": 8,
    "latent_dim": 2, "uv_frequencies": 2, "search_samples": 16, "rays": 64, "iterations": 8, "manifold_start": "sphere",
}  # fmt: skip
BLIND = Perceptual(None, None, ())


@pytest.fixture(autouse=True)
def no_perceptual_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "find_perceptual", lambda device: BLIND)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return make_scene(tmp_path_factory.mktemp("scene"), OPAQUE, size=20, surface_radius=0.33)


def job(scene: Scene, scratch: Path, values: dict[str, object]) -> Job:
    conditions = Conditions(commit="aaa", clock="wall", threads=1, machine="one", frames=2)
    return Job("spheres", scene.folder, train_params(values), "", conditions, scratch)


class Steps:
    """Time by training steps: ten seconds each."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, die_at: int = 1 << 30) -> None:
        self.done = 0
        self.die_at = die_at
        monkeypatch.setattr(runs, "time_source", lambda kind, threads: lambda: 10.0 * self.done)
        monkeypatch.setattr(runs, "train_step", self.step)

    def step(self, state: object, *rest: object) -> None:
        if self.done == self.die_at:
            raise KeyboardInterrupt
        self.done += 1
        train_step(state, *rest)  # type: ignore[arg-type]


def test_one_run_is_scored_on_its_way(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Steps(monkeypatch)
    made: list[Measurement] = []
    measure_on_the_way(job(scene, tmp_path, TINY), [15, 12, 30], made.append)
    assert [(m.budget, m.seconds, m.iterations) for m in made] == [(12, 20, 2), (15, 20, 2), (30, 30, 3)]
    assert all(m.scores is not None and m.scores.region == "subject" and m.scores.images == 2 for m in made)
    assert made[0].peak_memory_bytes == made[-1].peak_memory_bytes > 0


def test_the_scores_are_those_of_the_model_that_training_makes(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Steps(monkeypatch)
    made: list[Measurement] = []
    measure_on_the_way(job(scene, tmp_path, TINY), [80], made.append)
    train(scene, train_params(TINY), tmp_path / "model", tmp_path / "checkpoints", tmp_path / "log")
    assert made[0].iterations == TINY["iterations"]
    assert made[0].scores == score(scene, load_model(tmp_path / "model"), 2, BLIND)


def test_an_interrupted_run_goes_on_to_the_same_scores(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole: list[Measurement] = []
    Steps(monkeypatch)
    measure_on_the_way(job(scene, tmp_path / "whole", TINY), [20, 60], whole.append)
    parts: list[Measurement] = []
    Steps(monkeypatch, die_at=4)
    with pytest.raises(KeyboardInterrupt):
        measure_on_the_way(job(scene, tmp_path / "parts", TINY), [20, 60], parts.append)
    assert [m.budget for m in parts] == [20]
    Steps(monkeypatch)
    measure_on_the_way(job(scene, tmp_path / "parts", TINY), [60], parts.append)
    assert [(m.seconds, m.iterations, m.scores) for m in parts] == [(m.seconds, m.iterations, m.scores) for m in whole]


def test_a_budget_before_the_checkpoint_begins_anew(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Measurement] = []
    Steps(monkeypatch)
    measure_on_the_way(job(scene, tmp_path, TINY), [50], made.append)
    Steps(monkeypatch)
    measure_on_the_way(job(scene, tmp_path, TINY), [30], made.append)
    assert [(m.seconds, m.iterations) for m in made] == [(50, 5), (30, 3)]


def test_an_explicit_run_is_scored_at_its_end(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Which trainer makes the model is of no concern here, and this one needs no compiled code.
    def trainer(scene: Scene, params: TrainParams, model: Path, log: Path) -> TrainingReport:
        assert params.preset == "fast"
        return train(scene, train_params(TINY), model, tmp_path / "checkpoints", log)

    monkeypatch.setattr(runs, "train_explicit", trainer)
    made: list[Measurement] = []
    measure_whole(job(scene, tmp_path, {"preset": "fast"}), 10, made.append)
    train(scene, train_params(TINY), tmp_path / "model", tmp_path / "checkpoints", tmp_path / "log")
    assert made[0].iterations == TINY["iterations"] and made[0].budget == 10
    assert made[0].scores == score(scene, load_model(tmp_path / "model"), 2, BLIND)


def test_without_masks_the_whole_frame_is_scored(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, size=20, surface_radius=0.33)
    (scene.folder / "masks.arrow").unlink()
    train(scene, train_params(TINY), tmp_path / "model", tmp_path / "checkpoints", tmp_path / "log")
    assert score(scene, load_model(tmp_path / "model"), 1, BLIND).region == "frame"


def test_clock_of_processor_time_is_divided() -> None:
    clock = Clock(runs.time_source("processor", 1000))
    sum(range(300_000))
    assert 0 < clock.seconds < 0.1
