"""The library as somebody in a notebook uses it: from a scene to a model, an asset, its scores and a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import facefolds_core as facefolds
from facefolds_core.asset.reader import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.training.trained import Trained
from tests.scenes import OPAQUE, make_scene

pytestmark = pytest.mark.slow

SMALL = {
    "sample": {"resolution": 48},
    "decimate": {"resolution": 10},
    "texture": {"resolution": 48},
    "compress": {"levels": [{"name": "small", "mesh_resolution": 6, "texture_resolution": 24, "crf": 30}]},
}
NO_WEIGHTS = Perceptual(None, None, ())

Made = tuple[Scene, Trained, Asset]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("library")
    make_scene(folder / "scene", size=40, surface_radius=OPAQUE[0].radius, mattes=True)
    scene = facefolds.load_scene(folder / "scene")
    params = {"preset": "fast", "layers": 4, "iterations": 330}
    trained = facefolds.train(scene, facefolds.train_params(params))
    asset = facefolds.export_asset(trained.model, scene, folder / "face", facefolds.ExportParams.model_validate(SMALL))
    return scene, trained, asset


def test_the_asset_is_sound_and_has_its_levels(made: Made) -> None:
    _, trained, asset = made
    assert facefolds.validate(asset.folder) == []
    assert [level.entry.name for level in asset.levels] == ["small", "full"]
    assert asset.num_frames == trained.model.num_frames == 2


def test_it_shows_what_was_filmed(made: Made) -> None:
    scene, trained, asset = made
    scores = facefolds.evaluate(asset, scene, trained.model, perceptual=NO_WEIGHTS).scores
    found = [s.values["psnr_subject"] for s in scores if s.variant == "asset"]
    assert len(found) == 2 and all(value is not None and value > 17 for value in found)
    index = scene.indices("holdout")[0]
    rgb, alpha = facefolds.render(asset, scene.cameras[index], 0)
    truth = scene.open_frames().image(index, 0) / 255
    covered = alpha > 0.9
    assert covered.mean() > 0.05
    assert np.abs(rgb - truth)[covered].mean() < 0.2


def test_a_model_is_saved_and_read(made: Made, tmp_path: Path) -> None:
    made[1].save(tmp_path / "model")
    assert {p.name for p in (tmp_path / "model").iterdir()} == {
        *("model.safetensors", "model.json", "training.json", "fit.json", "fit.png")
    }
    again = facefolds.load_model(tmp_path / "model").state_dict()
    for name, tensor in made[1].model.state_dict().items():
        np.testing.assert_array_equal(tensor.numpy(), again[name].numpy())


def test_another_scene_is_refused(made: Made, tmp_path: Path) -> None:
    other = make_scene(tmp_path / "scene", size=40, frames=3)
    with pytest.raises(UserError, match="do not belong together"):
        facefolds.export_asset(made[1].model, other, tmp_path / "face")
    assert not (tmp_path / "face").exists()
