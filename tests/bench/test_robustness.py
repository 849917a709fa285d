"""Disturbed starts: the scene that is meant, the values that are meant, failures kept, the table."""

from pathlib import Path

import numpy as np
import pytest

from bench import robustness
from bench.common import keep
from bench.results import Conditions, Results, Scores
from bench.robustness import BASE, Variant, all_variants, disturbed_scene, measure, overrides, tables
from bench.runs import Job
from facefolds_core.captures.scene import SPHERE_CENTRE, read_scene
from facefolds_core.errors import UserError
from facefolds_core.params import train_params
from tests.scenes import OPAQUE, make_scene

CENTRE = np.array(SPHERE_CENTRE)


def job(scene: Path, preset: str, variant: str, scratch: Path) -> Job:
    conditions = Conditions(commit="aaa", clock="wall", threads=2, machine="one", frames=3)
    return Job("actor", scene, train_params({"preset": preset}), variant, conditions, scratch)


def test_a_shifted_scene_shows_the_same_from_elsewhere(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, size=12, surface_radius=0.33)
    shift = np.array([0.05, -0.02, 0.01])
    disturbed_scene(scene.folder, Variant("off", shift=tuple(shift)), tmp_path / "off")
    moved = read_scene(tmp_path / "off")
    before, after = scene.load_surface(), moved.load_surface()
    assert before is not None and after is not None
    # c stands still, so the subject moves against it the other way, and every camera with the subject.
    assert after[0] == pytest.approx(before[0] - shift, abs=1e-6)
    for old, new in zip(scene.cameras, moved.cameras, strict=True):
        assert new.project(after[0][0].astype(float))[0] == pytest.approx(
            old.project(before[0][0].astype(float))[0], abs=1e-3
        )
    assert (moved.open_frames().image(0, 1) == scene.open_frames().image(0, 1)).all()
    assert moved.open_masks() is not None and moved.splits == scene.splits


def test_a_start_that_is_too_far_out(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, size=12, surface_radius=0.33)
    disturbed_scene(scene.folder, Variant("far", radius=1.2), tmp_path / "far")
    surface = read_scene(tmp_path / "far").load_surface()
    assert surface is not None
    assert np.linalg.norm(surface[0] - CENTRE, axis=-1) == pytest.approx(1.2 * 0.33, abs=1e-5)


def test_no_mesh_no_other_radius(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, size=12)
    with pytest.raises(UserError, match="no tracked mesh"):
        disturbed_scene(scene.folder, Variant("far", radius=1.2), tmp_path / "far")


def test_rates_and_seeds_are_overrides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(robustness.GEOMETRY_RATES, "fast", ())
    assert overrides(Variant("rate", rate=3.0), "paper") == {"seed": 0, "lr_manifold": pytest.approx(3 * 7e-4)}
    assert overrides(Variant("seed 3", seed=3), "fast") == {"seed": 3}
    assert overrides(Variant("rate", rate=3.0), "fast") is None
    monkeypatch.setitem(robustness.OVERRIDES, ("rate", "fast"), {"layers": 3})
    assert overrides(Variant("rate", rate=3.0), "fast") == {"layers": 3}


def test_names_of_variants_differ() -> None:
    names = [variant.name for variant in all_variants(5)]
    assert len(names) == len(set(names)) == 12


def test_a_failure_is_a_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def diverge(*_: object) -> None:
        raise UserError("training diverged", remedy="none")

    monkeypatch.setattr(robustness, "in_a_process", diverge)
    results = Results(tmp_path / "results.json")
    measure(job(tmp_path, "paper", "seed 1", tmp_path / "scratch"), Variant("seed 1", seed=1), 60.0, results, False)
    (made,) = results.read()
    assert (made.failure, made.scores, made.variant) == ("training diverged", None, "seed 1")
    assert "1 of 1 failed" in tables(results.read())


def test_the_table(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    for variant, psnr in (("", 27.0), ("seed 1", 27.2), ("seed 2", 26.9), ("geometry's rate x 3", 25.5)):
        scores = Scores(region="subject", images=6, psnr=psnr, ssim=0.8, lpips=None, st_lpips=None)
        keep(path, job(tmp_path, "quick", variant, tmp_path).measurement(60.0, 61.0, 100, 3 << 29, scores))
    text = tables(Results(path).read())
    assert "| `actor` | `quick` |" in text
    assert "| as it is: dB, training time | 27.00 in 61 s |" in text
    assert "| 27.03, 0.30, 0 of 3 failed |" in text
    assert "| geometry's rate x 3 | 25.50 (-1.50) |" in text
    assert "| start radius - 20 % | - |" in text
    assert "| peak memory of any of these | 1.50 GiB |" in text


def test_the_base_is_the_preset_as_it_is() -> None:
    assert overrides(BASE, "fast") == {"seed": 0}
