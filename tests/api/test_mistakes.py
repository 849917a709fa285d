"""What a person can get wrong: errors that name what was expected and what was found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import facefolds_core as facefolds
from facefolds_core.api.scene import Scene
from facefolds_core.api.subject import Subject
from facefolds_core.errors import UserError
from tests.assets import make_asset
from tests.scenes import make_scene


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    make_scene(tmp_path / "made" / "scene", size=24)
    return facefolds.load_scene(tmp_path / "made" / "scene")


def test_a_path_with_nothing(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing there") as caught:
        facefolds.load_capture(tmp_path / "nobody")
    assert caught.value.file == tmp_path / "nobody"


def test_a_folder_that_is_no_capture(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(UserError, match="not a capture") as caught:
        facefolds.load_capture(tmp_path)
    assert "multiface" in str(caught.value.expected) and "neural3d" in str(caught.value.expected)
    assert caught.value.found is not None and caught.value.remedy is not None


def test_a_layout_that_it_is_not(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(UserError, match="not a capture of source colmap"):
        facefolds.load_capture(tmp_path, source="colmap")


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"holdout": 7}, "load_capture.holdout"),
        ({"hold_out": ["A000"]}, "hold_out"),
        ({"train": {"layers": 3}}, "to the step"),
        ({"name": "a b"}, "not a name"),
    ],
)
def test_wrong_keys_of_a_capture(tmp_path: Path, keys: dict[str, Any], says: str) -> None:
    with pytest.raises(UserError, match=says):
        facefolds.load_capture(tmp_path, source="multiface", folder=tmp_path / "work", **keys)


@pytest.mark.parametrize("frame", [-1, 2])
def test_a_frame_that_is_not_there(scene: Scene, tmp_path: Path, frame: int) -> None:
    make_asset(tmp_path / "asset", layers=1, frames=2, resolution=16)
    asset = facefolds.load_asset(tmp_path / "asset")
    for ask in (
        lambda: asset.render("poster", frame),
        lambda: asset.save_glb(tmp_path / "a.glb", frame),
        lambda: scene.photo("cam0", frame),
    ):
        with pytest.raises(UserError, match="no such frame") as caught:
            ask()
        assert (caught.value.found, str(caught.value.expected)[:6]) == (frame, "0 to 1")


def test_a_camera_that_is_not_there(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such camera") as caught:
        scene.photo("nobody", 0)
    assert (caught.value.found, str(caught.value.expected).split(", ")[0]) == ("nobody", scene.cameras[0].name)
    make_asset(tmp_path / "asset", layers=1, frames=2, resolution=16)
    with pytest.raises(UserError, match="no scene lies beside"):
        facefolds.load_asset(tmp_path / "asset").render("cam0", 0)


def test_wrong_parameters_of_a_step(scene: Scene) -> None:
    with pytest.raises(UserError, match=r"subject\.iteration") as caught:
        facefolds.find_subject(scene, iteration=3)
    assert "iterations" in str(caught.value.expected)
    with pytest.raises(UserError, match="unknown preset 'slow'"):
        facefolds.train(scene, preset="slow")


def test_the_subject_of_another_scene(scene: Scene, tmp_path: Path) -> None:
    other = Subject(scene, tmp_path / "other" / "subject", None)  # type: ignore[arg-type]
    with pytest.raises(UserError, match="do not belong together") as caught:
        facefolds.train(scene, other)
    assert str(scene.folder) in str(caught.value.expected)


def test_an_asset_of_another_scene(scene: Scene, tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=1, frames=2, resolution=16)
    with pytest.raises(UserError, match="do not belong together"):
        facefolds.evaluate(facefolds.load_asset(tmp_path / "asset"), scene)


def test_a_scene_without_a_folder_of_work(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="load_scene"):
        facefolds.find_subject(replace(scene, folder=tmp_path / "made" / "scene"))


def test_a_subject_that_is_there_already(scene: Scene, tmp_path: Path) -> None:
    facefolds.load_scene(tmp_path / "made" / "scene", tmp_path / "work")
    with pytest.raises(UserError, match="there already"):
        facefolds.load_scene(tmp_path / "made" / "scene", tmp_path / "work")


def test_no_model(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no model there"):
        facefolds.load_model(tmp_path / "model")
