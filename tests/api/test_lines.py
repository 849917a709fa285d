"""The lines that people type, from footage to scores: the cells of the documents' notebook, on a tinier film."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

import facefolds_core as facefolds
from docs.tools.notebook import NOTEBOOK, run
from facefolds_core.api import asset as shown
from facefolds_core.errors import UserError
from facefolds_core.training.explicit.second_surface import LAYERS
from tests.hostile.damage import fingerprint

pytestmark = pytest.mark.slow

CUT = {
    "sample": {"resolution": 48},
    "decimate": {"resolution": 12},
    "texture": {"resolution": 48},
    "compress": {"levels": [], "video": {"target_psnr": None, "preset": "fast"}},
}
SMALLER = {
    "cameras=12, frames=3, height=96, width=64": "name='anna', folder='FOLDER/data', mattes=True, "
    "cameras=8, frames=2, height=48, width=32",
    "iterations=400": "iterations=60",
    'layers=6, iterations=150, geometry={"nodes": 96, "round_iterations": 30}': "layers=3, iterations=63, "
    'geometry={"nodes": 48, "round_iterations": 20}',
    'export("face", sample={"resolution": 96}, decimate={"resolution": 24}, texture={"resolution": 96}': "export("
    f"'FOLDER/face', **{CUT}",
}
"""What the notebook has, and what is run here in its place."""


@dataclass(frozen=True)
class Made:
    """What the lines give, and the folder of work."""

    folder: Path
    capture: facefolds.Capture
    scene: facefolds.Scene
    subject: facefolds.Subject
    model: facefolds.Model
    asset: facefolds.Asset
    scores: facefolds.Scores


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder, text = tmp_path_factory.mktemp("lines"), NOTEBOOK.read_text(encoding="utf-8")
    for old, new in SMALLER.items():
        old, new = (json.dumps(words.replace("FOLDER", str(folder)))[1:-1] for words in (old, new))
        assert text.count(old) == 1, f"the notebook has not once: {old}"
        text = text.replace(old, new)
    names = dict[str, Any]()
    for _ in run(json.loads(text), folder, names):
        pass
    return Made(folder, *(names[field.name] for field in fields(Made)[1:]))


def test_each_says_what_it_is(made: Made) -> None:
    assert repr(made.capture).startswith("Capture(anna, actor: 8 cameras, 2 frames at 1.33333 a second")
    assert repr(made.scene).startswith("Scene(anna: 8 cameras, 1 of them not for training, 2 frames")
    assert repr(made.subject).startswith("Subject(anna: ")
    count = len(made.asset.layers)
    assert 3 <= count <= 3 + LAYERS  # a film as tiny may have a second surface; layers that show nothing are left out
    layers = f"{count} layers"
    assert repr(made.model) == f"Model(anna: {layers}, 2 frames)"
    assert layers in repr(made.asset) and "2 frames" in repr(made.asset)
    assert "PSNR over any background, dB" in repr(made.scores)


def test_what_was_filmed_is_a_capture_like_any_other(made: Made, tmp_path: Path) -> None:
    capture = facefolds.load_capture(made.capture.folders.capture, name="bea", folder=tmp_path, holdout=["A005"])
    assert repr(capture).startswith("Capture(bea, multiface: 8 cameras, 2 frames at 30 a second")


def test_model_and_asset_show_what_was_filmed(made: Made) -> None:
    photo = made.scene.photo("A005", 1).astype(float)
    subject = made.subject.matte("A005", 1) > 250
    assert subject.mean() > 0.05
    for picture in (made.model.render("A005", 1, (0, 0, 0)), made.asset.render("A005", 1, (0, 0, 0))):
        assert picture.dtype == np.uint8 and picture.shape == photo.shape
        assert np.abs(picture - photo)[subject].mean() < 40


def test_without_a_background_a_picture_is_transparent(made: Made) -> None:
    for thing in (made.model, made.asset):
        picture = thing.render(made.scene.cameras[0], 0)
        assert picture.shape == (48, 32, 4) and picture[0, 0, 3] < 64 and picture[..., 3].max() > 200
        over = thing.render(made.scene.cameras[0], 0, background=(1, 0, 0))
        alpha = picture[..., 3:] / 255
        blended = picture[..., :3] * alpha + (1 - alpha) * np.array([255, 0, 0])
        assert np.abs(blended - over).max() < 3  # three roundings to 8 bits


def test_the_asset_is_sound_and_becomes_other_files(made: Made, tmp_path: Path) -> None:
    assert facefolds.validate(made.asset.folder) == []
    made.asset.save_glb(tmp_path / "face.glb", frame=1)
    scene = trimesh.load_scene(tmp_path / "face.glb")
    assert len(scene.geometry) == 2  # an opaque core and a soft shell
    layer, texture = made.asset.layers[0], made.asset.frame(0)[0]
    mesh = layer.to_trimesh(texture)
    assert isinstance(mesh, trimesh.Trimesh) and mesh.faces.shape == layer.faces.shape
    np.testing.assert_allclose(mesh.visual.uv[:, 1], 1 - layer.st[:, 1])


def test_the_scores_are_those_of_metrics_json(made: Made) -> None:
    assert made.scores["psnr_any"] == made.scores.metrics["asset"]["psnr_any"]
    value = made.scores["psnr_any"]
    assert value is not None and value > 8
    assert (made.scores.folder / "contact_sheet.png").is_file()


def test_the_folder_of_work_is_laid_out_as_the_stages_have_it(made: Made) -> None:
    """So that `facefolds report` and `python -m stages.NAME --data FOLDER` go on."""
    root = made.folder / "data"
    expected = {"scene", "subject", "model", "samples", "surfaces", "meshes", "resampled", "textures", "asset"}
    assert expected | {"asset.glb", "metrics.json", "evaluation"} <= {path.name for path in (root / "anna").iterdir()}
    assert (root / ".config" / "anna" / "train.json").is_file() and (root / ".timings" / "anna" / "bake.json").is_file()


def test_a_loaded_model_is_the_same_and_leaves_its_folder_alone(made: Made) -> None:
    before = fingerprint(made.folder / "data")
    model = facefolds.load_model(made.folder / "data" / "anna" / "model")
    np.testing.assert_array_equal(model.render("A000", 0), made.model.render("A000", 0))
    asset = model.export(**CUT)
    assert not asset.folder.is_relative_to(made.folder)
    np.testing.assert_array_equal(asset.frame(1)[0], made.asset.frame(1)[0])
    assert fingerprint(made.folder / "data") == before


def test_a_scene_shows_its_cameras(made: Made) -> None:
    svg = made.scene._repr_html_()
    assert svg.startswith("<svg") and svg.count("<polygon") == 2 * len(made.scene.cameras)
    assert svg.count("A005 (holdout)") == 2


def test_a_subject_shows_its_cut_outs(made: Made) -> None:
    assert made.subject._repr_jpeg_().startswith(b"\xff\xd8")


def test_an_asset_plays_itself(made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "single.js").write_text('/* "the player" */')
    monkeypatch.setattr(shown, "find_player", lambda: tmp_path)
    page = made.asset._repr_html_()
    assert page.startswith('<iframe srcdoc="') and page.count('"') == 6  # the page's own quotes are escaped
    assert "the player" in page and "full.mp4" in page
    made.asset.save_html(tmp_path / "face.html")
    assert "the player" in (tmp_path / "face.html").read_text()


def test_without_a_player_an_asset_shows_its_poster(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> Path:
        raise UserError("the web player has not been built")

    monkeypatch.setattr(shown, "find_player", missing)
    page = made.asset._repr_html_()
    assert "data:image/jpeg;base64," in page and "make view" in page


def test_a_picture_can_be_saved(made: Made, tmp_path: Path) -> None:
    Image.fromarray(made.asset.render("poster", 0)).save(tmp_path / "face.png")
    assert Image.open(tmp_path / "face.png").mode == "RGBA"
