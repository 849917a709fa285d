"""Training cameras that see the asset badly are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.files.frame_store import write_frames
from facefolds_core.params import EvaluateParams
from facefolds_core.scoring.training_scores import TrainingView, bad_views, compared_by, warnings_of
from facefolds_core.scoring.training_views import training_views
from tests.scoring.fakes import FRAMES, SIZE, flat_asset, flat_scene


def view(camera: str, **values: float | None) -> TrainingView:
    known = {"psnr_any": None, "psnr_over_plate": None, "psnr_found": 20.0, **values}
    return TrainingView(camera, "0", known, np.zeros((2, 2, 3)), np.zeros((2, 2, 3)))


def test_they_are_compared_by_what_all_of_them_have() -> None:
    assert compared_by([view("a", psnr_any=30.0), view("b")]) == "psnr_found"
    assert compared_by([view("a", psnr_any=30.0), view("b", psnr_any=31.0)]) == "psnr_any"
    assert compared_by([]) == "psnr_any" and bad_views([]) == [] and warnings_of([]) == []


@pytest.mark.parametrize(("psnr", "bad"), [(26.0, []), (24.9, ["d"])])
def test_one_that_is_far_behind_the_others_is_a_warning(psnr: float, bad: list[str]) -> None:
    views = [view(name, psnr_any=30.0) for name in "abc"] + [view("d", psnr_any=psnr)]
    assert [one.camera for one in bad_views(views)] == bad
    assert [one.values["camera"] for one in warnings_of(views)] == bad


def test_one_that_sees_nothing_of_the_asset_is_the_worst() -> None:
    """It has no picture where the asset is opaque; the others are compared all the same."""
    views = [view(name, psnr_found=psnr) for name, psnr in (("a", 30.0), ("b", 31.0), ("c", 10.0), ("d", None))]
    assert [one.camera for one in bad_views(views)] == ["d", "c"]
    assert [one.values["median"] for one in warnings_of(views)] == [30.0, 30.0]
    assert all("dB only" in str(one) for one in warnings_of(views))
    assert compared_by([view("a", psnr_found=None)]) is None and warnings_of([view("a", psnr_found=None)]) == []


def test_all_training_cameras_with_a_photo_are_looked_at(tmp_path: Path) -> None:
    """In the middle frame; by the mattes that training may use, where they are."""
    scene = flat_scene(tmp_path)
    found = training_views(scene, flat_asset(), EvaluateParams())
    assert [one.camera for one in found] == [scene.cameras[i].name for i in (1, 2)]
    assert {one.frame for one in found} == {scene.frame_ids[FRAMES // 2]}
    assert {one.values["psnr_any"] for one in found} == {None}
    solid = np.full((SIZE, SIZE, 1), 255, np.uint8)
    write_frames(tmp_path / "mattes.arrow", (SIZE, SIZE, 1), ((i, FRAMES // 2, solid) for i in (1, 2)))
    known = training_views(scene, flat_asset(), EvaluateParams())
    assert all(one.values["psnr_any"] is not None and one.values["opacity_inside"] is not None for one in known)
