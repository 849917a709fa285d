"""Scores of a model and an asset on a scene where they are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
import torch

from facefolds_core.asset import Asset
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import write_frames
from facefolds_core.geometry.track import Track
from facefolds_core.params import EvaluateParams
from facefolds_core.rendering.pixels import finer, pixel_means
from facefolds_core.scoring.evaluation import evaluate
from facefolds_core.scoring.images import MASK_MARGIN, score_images, subject_box
from facefolds_core.scoring.metrics import MAX_PSNR
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.panels import ALL_METRICS, METRICS, SUBJECT_METRICS, VARIANTS, Evaluation
from facefolds_core.scoring.perceptual import Perceptual, find_perceptual
from tests.assets import make_asset
from tests.geometry.test_track import about
from tests.scenes import look_at_origin
from tests.scoring.fakes import FRAMES, SIZE, FlatAsset, flat_asset, flat_scene, half_mask, pictures, tiny_model


def run(scene: Scene, asset: Asset | None = None, view_bias: float = 0.0, **keys: object) -> Evaluation:
    """By default of an asset that shows the truth."""
    return evaluate(scene, tiny_model(view_bias), asset or flat_asset(), EvaluateParams(**keys), Perceptual())  # type: ignore[arg-type]


def test_every_image_has_every_score_and_an_asset_that_shows_the_truth_is_perfect(tmp_path: Path) -> None:
    scores = run(flat_scene(tmp_path)).scores
    keys = [(s.camera, s.frame, s.variant) for s in scores]
    assert keys == [("front", f"{k:06d}", v) for k in range(FRAMES) for v in VARIANTS]
    assert all(list(s.values) == list(ALL_METRICS) for s in scores)
    lacking = [*SUBJECT_METRICS, *(name for name in METRICS if "lpips" in name)]  # neither masks nor weights
    assert all(s.values[name] is None for s in scores for name in lacking)
    found = [s.values for s in scores if s.variant == "asset"]
    assert [v["psnr"] for v in found] == [MAX_PSNR] * FRAMES
    np.testing.assert_allclose([v["ssim"] for v in found], 1)  # type: ignore[arg-type]


def test_an_asset_stands_where_its_own_track_says(tmp_path: Path) -> None:
    """What ships is scored: the scene's poses move the model, not the asset."""
    scene = flat_scene(tmp_path)
    track = Track.of([about((1, 1, 0), 20)] * FRAMES, [[0.1, 0.05, 0]] * FRAMES)
    world = tuple(camera.transformed(track.at(0)) for camera in scene.cameras)
    moved = replace(scene, cameras=world, poses=track)
    found, still = run(moved, cast(Asset, FlatAsset(pictures(), track))), run(scene)
    psnrs = [s.values["psnr"] for s in found.scores]
    assert psnrs == pytest.approx([s.values["psnr"] for s in still.scores], abs=1e-3)
    assert all(cast(float, s.values["psnr"]) < 20 for s in run(moved).scores if s.variant == "asset")


def test_an_image_without_a_mask_and_one_with_an_empty_mask_are_not_counted(tmp_path: Path) -> None:
    scores = run(flat_scene(tmp_path, {0: half_mask(), 2: np.zeros_like(half_mask())})).scores
    assert [s.values["psnr_subject"] is not None for s in scores if s.variant == "asset"] == [True, False, False]


def test_an_error_outside_the_mask_spares_the_subject() -> None:
    truth = pictures()[0] / 255
    mask = half_mask()[..., 0] / 255
    image = truth.copy()
    image[:, SIZE // 2 :] = 1 - image[:, SIZE // 2 :]
    values = score_images({"asset": image}, truth, mask, find_perceptual())["asset"]
    assert values["psnr_subject"] == MAX_PSNR
    assert values["ssim_subject"] == pytest.approx(1)
    assert values["st_lpips_subject"] in (None, 0)
    assert values["psnr"] is not None
    assert values["psnr"] < 20


def test_the_background_shows_where_the_model_is_transparent(tmp_path: Path) -> None:
    scene, behind = flat_scene(tmp_path), [(0.0, 0.0, 0.0), (0.2, 0.4, 0.6)]
    corners = [run(scene, background=colour).panels[0].model[0, 0] for colour in behind]
    np.testing.assert_allclose(corners, behind, atol=1e-12)


def test_the_view_branch_tells_model_from_diffuse() -> None:
    view = ModelView(tiny_model(view_bias=0.25), look_at_origin("front", 0, 0, SIZE))
    on, off, alpha = view.render(0)
    # The grey term 0.25 is weighted as the colours are, so it adds 0.25 of the opacity.
    np.testing.assert_allclose(on - off, np.broadcast_to(0.25 * alpha[..., None], on.shape), atol=1e-5)


@pytest.mark.parametrize("view_effects", [True, False])
def test_a_view_of_the_model_is_what_the_model_renders(view_effects: bool) -> None:
    model, camera = tiny_model(view_bias=0.1), look_at_origin("side", 30, 10, SIZE)
    fine = finer(camera)
    origins, directions = (torch.tensor(np.reshape(x, (-1, 3)), dtype=torch.float32) for x in fine.rays())
    expected = model.render(origins, directions, 1.5, view_effects)
    on, off, alpha = ModelView(model, camera).render(1.5)
    rgb, opacity = (part.numpy().reshape(fine.height, fine.width, -1) for part in (expected.rgb, expected.alpha))
    np.testing.assert_allclose(on if view_effects else off, pixel_means(rgb), atol=2e-6)
    np.testing.assert_allclose(alpha, pixel_means(opacity[..., 0]), atol=2e-6)


def test_the_shipped_files_are_what_is_scored(tmp_path: Path) -> None:
    asset = make_asset(tmp_path / "asset", layers=2, frames=FRAMES, resolution=32)
    found = run(flat_scene(tmp_path / "scene"), asset)
    assert len(found.scores) == FRAMES * len(VARIANTS)
    assert found.panels[0].asset.std() > 0.05


def test_what_cannot_be_scored_is_refused(tmp_path: Path) -> None:
    scene = flat_scene(tmp_path)
    with pytest.raises(UserError, match=r"no held-out camera[\s\S]*remedy[\s\S]*holdout"):
        run(replace(scene, splits=("train",) * 3))
    with pytest.raises(UserError, match="different numbers of frames"):
        run(scene, flat_asset(pictures()[:2]))
    with pytest.raises(UserError, match=r"not finite[\s\S]*camera front, frame 000000"):
        run(scene, view_bias=float("nan"))
    write_frames(tmp_path / "frames.arrow", (SIZE, SIZE, 3), [(1, 0, np.zeros((SIZE, SIZE, 3), np.uint8))])
    with pytest.raises(UserError, match="has a photo"):
        run(scene)


def test_the_subjects_box_has_a_margin_within_the_frame() -> None:
    mask = np.zeros((60, 40))
    mask[20:30, 2:5] = 1
    assert subject_box(mask) == (slice(20 - MASK_MARGIN, 30 + MASK_MARGIN), slice(0, 5 + MASK_MARGIN))
    assert subject_box(np.full((9, 9), 0.05)) is None  # a faint one is empty


def test_the_worst_picture_is_kept_though_it_is_not_on_the_sheet(tmp_path: Path) -> None:
    shown = pictures()
    shown[1] = 255 - shown[1]
    found = run(flat_scene(tmp_path, {k: half_mask() for k in range(FRAMES)}), flat_asset(shown), sheet_frames=2)
    assert [panel.frame for panel in found.panels] == ["000000", "000002"]
    assert found.worst.frame == "000001"
    np.testing.assert_array_equal(found.worst.asset, shown[1] / 255)
