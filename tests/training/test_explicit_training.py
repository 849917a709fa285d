"""The explicit model's trainer on tiny analytic scenes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from facefolds_core.captures.scene import SPHERE_CENTRE, Scene
from facefolds_core.errors import UserError
from facefolds_core.facts import read_fact
from facefolds_core.files.frame_store import write_frames
from facefolds_core.model import load_model
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.params import ExplicitParams, train_params
from facefolds_core.subject.outline import Profile
from facefolds_core.training.explicit import fit, trainer
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.explicit.offsets import Offsets
from facefolds_core.training.explicit.state import TextureState
from tests.scenes import OPAQUE, make_scene

pytestmark = pytest.mark.slow

GEOMETRY = ExplicitParams().geometry


def _params(**values: object) -> ExplicitParams:
    few = {"iterations": 10, "geometry": {"nodes": 48, "round_iterations": 15}}
    small = {"layers": 6, "reflection": {"texels": 6, "environment_texels": 4}, **few}
    params = train_params({"preset": "fast", **small, **values})
    assert isinstance(params, ExplicitParams)
    return params


def _fitted(scene: Scene, folder: Path, **values: object) -> Path:
    """The saved model."""
    fit_explicit(scene, _params(**values), folder / "log").save(folder / "model")
    return folder / "model"


def _held_out_psnr(scene: Scene, folder: Path) -> float:
    model = load_model(folder)
    store, masks = scene.open_frames(), scene.open_masks()
    assert masks is not None
    errors = []
    for index in scene.indices("holdout"):
        rays = scene.cameras[index].rays()
        origins, directions = (torch.from_numpy(np.ascontiguousarray(a.reshape(-1, 3))).float() for a in rays)
        for frame in range(scene.num_frames):
            mask = masks.image(index, frame).reshape(-1) == 255
            rgb = model.render(origins, directions, float(frame), False).rgb.numpy()
            errors.append(((rgb - store.image(index, frame).reshape(-1, 3) / 255)[mask] ** 2).mean())
    return float(-10 * np.log10(np.mean(errors)))


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Path]:
    folder = tmp_path_factory.mktemp("explicit")
    scene = make_scene(folder / "scene", size=64, surface_radius=OPAQUE[0].radius, mattes=True)
    return scene, _fitted(scene, folder, iterations=330, geometry={}, textures={"pixels_per_texel": 1.2})


def test_a_textured_sphere_is_seen_from_a_new_camera(trained: tuple[Scene, Path]) -> None:
    assert _held_out_psnr(*trained) > 22


def test_model_folder_is_whole_and_says_why(trained: tuple[Scene, Path]) -> None:
    """A matte sphere's reflection is tried, found to gain nothing on cameras left out, and said to be left out."""
    names = {p.name for p in trained[1].iterdir()}
    assert names == {"model.safetensors", "model.json", "training.json", "params.json", "fit.json"}
    ran = json.loads((trained[1] / "params.json").read_text())
    assert ran == json.loads(_params(iterations=330, geometry={}, textures={"pixels_per_texel": 1.2}).model_dump_json())
    said = json.loads((trained[1] / "fit.json").read_text())
    assert "no_reflection" in {event["kind"] for event in said["events"]}
    assert load_model(trained[1]).reflection_maps() is None
    reasons = [read_fact(value) for value in said["reasons"]]
    wanted = ["centre_chosen", "window_chosen", "middle_from_mesh", "halfwidth_chosen", "texels_chosen"]
    assert [reason.kind for reason in reasons][:5] == wanted
    assert 0 <= reasons[0].values["lost"] < 1


def test_surface_points_lie_on_the_sphere(trained: tuple[Scene, Path]) -> None:
    model = load_model(trained[1])
    points, valid = model.surface_points(torch.zeros(1, 2))
    assert valid.all()
    # The model's centre is fitted; the sphere stands around the scene's.
    mean = (points[:, 0] - torch.tensor(SPHERE_CENTRE)).norm(dim=-1).mean().item()
    assert mean == pytest.approx(OPAQUE[0].radius, abs=0.003)
    radius = (points[:, 0] - model.centre).norm(dim=-1)
    assert (radius[:-1] > radius[1:]).all()


def test_recentring_finds_the_opaque_layer_and_stays_where_there_is_none() -> None:
    layers, alpha = np.broadcast_to(np.linspace(0.05, -0.05, 11), (20, 20, 11)), np.zeros((20, 20, 11), np.float32)
    np.testing.assert_allclose(fit.recentre(layers, alpha, 2.0), 0, atol=1e-9)
    alpha[..., 3] = 1.0
    np.testing.assert_allclose(fit.recentre(layers, alpha, blur=2.0), layers[0, 0, 3], atol=1e-6)


def test_layers_are_as_thin_as_asked_for_where_the_subject_is_sharp() -> None:
    radius = np.full((30, 30), 0.3)
    opacity = np.ones((30, 30), np.float32)
    seen = Profile(radius, radius + 0.01, radius - 0.01, opacity, opacity[..., None].repeat(3, -1))
    samples = np.broadcast_to(np.linspace(0.9, 0.1, 17), (30, 30, 17))

    def widths(surface: float, voxel: float) -> np.ndarray:
        return fit.spread(seen, Offsets(samples, samples - surface), 0.006, 0.015, voxel)

    np.testing.assert_allclose(widths(0.3, voxel=0.01), 0.006)
    np.testing.assert_allclose(widths(0.3, voxel=0.002), 0.006 + 0.5 * (0.02 - 3 * 0.002))
    np.testing.assert_allclose(widths(0.8, voxel=0.01), 0.015)


def test_layers_are_as_many_pixels_wide_as_tell_something() -> None:
    params = GEOMETRY.model_copy(update={"halfwidth": 0.003, "max_halfwidth": 0.015})
    for pixel, least, most in (
        (0.0002, 0.003, 0.003),
        (0.001, 0.003, 0.008),
        (0.004, 0.006, 0.015),
        (0.1, 0.015, 0.015),
    ):
        assert fit.halfwidths(params, pixel) == pytest.approx((least, most))


def test_a_pixel_is_as_large_as_it_is_at_the_origin_in_the_median_training_camera(trained: tuple[Scene, Path]) -> None:
    """All cameras of the scene: focal length size / 0.7, distance 1."""
    assert fit.pixel_size(trained[0]) == pytest.approx(0.7 / 64, rel=0.02)


def test_divergence_is_reported(trained: tuple[Scene, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TextureState, "step", lambda self, *args: float("nan"))
    with pytest.raises(UserError, match="diverged"):
        _fitted(trained[0], tmp_path)
    assert not (tmp_path / "model").exists()


def test_layers_that_drift_inwards_stop_before_the_centre(
    trained: tuple[Scene, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Thin hair does that: the search for crossings needs a radius to step along."""
    monkeypatch.setattr(trainer, "recentre", lambda layers, *_: np.full(layers.shape[:2], -1.0))
    model = load_model(_fitted(trained[0], tmp_path))
    assert isinstance(model.manifolds, RadialManifolds)
    still = load_model(trained[1])
    assert isinstance(still.manifolds, RadialManifolds)
    drifted, start = model.manifolds.radii(), still.manifolds.radii()
    assert drifted.min() > 0.9 * start.min() and drifted.mean() < start.mean() - 0.005


def test_a_missing_image_is_said_at_once(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", size=8)
    image = np.zeros((8, 8, 3), np.uint8)
    write_frames(scene.folder / "frames.arrow", image.shape, [(i, 0, image) for i in range(len(scene.cameras))])
    with pytest.raises(UserError, match=r"image is missing[\s\S]*dvc repro"):
        _fitted(scene, tmp_path)


@pytest.mark.parametrize("missing", ["gaussians.npz", "mattes.arrow"])
def test_a_scene_whose_subject_was_not_found_is_refused(tmp_path: Path, missing: str) -> None:
    scene = make_scene(tmp_path / "scene", size=8, mattes=True)
    (scene.folder / missing).unlink()
    with pytest.raises(UserError, match=r"has not been found[\s\S]*dvc repro subject@spheres"):
        _fitted(scene, tmp_path)


def test_a_tracked_mesh_of_another_size_is_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All else is as without one, bit for bit: the same seed makes the same model."""
    models = []
    for name, radius in (("none", None), ("larger", 1.25 * OPAQUE[0].radius)):
        scene = make_scene(tmp_path / name / "scene", size=32, surface_radius=radius, mattes=True)
        folder = _fitted(scene, tmp_path / name, iterations=1, geometry={"nodes": 48, "round_iterations": 1})
        said = capsys.readouterr().out, (folder / "fit.json").read_text()
        assert all(("left out" in words) == (name == "larger") for words in said)
        models.append(load_model(folder).state_dict())
    assert all(torch.equal(a, b) for a, b in zip(*(model.values() for model in models), strict=True))
