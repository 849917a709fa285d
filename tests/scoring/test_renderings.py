"""Scores over a plate, inside and along the outline, and within a matte that is not the true one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.scoring.backgrounds import Rendering
from facefolds_core.scoring.images import Values, score_renderings
from facefolds_core.scoring.metrics import MAX_PSNR, shown
from facefolds_core.scoring.panels import FOUND_METRICS
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.scoring.truths import MatteKind, Truth

SIZE = 32
ROOM = np.random.default_rng(0).integers(0, 256, (SIZE, SIZE, 3)) / 255
FACE = np.random.default_rng(1).integers(0, 256, (SIZE, SIZE, 3)) / 255
MASK = np.zeros((SIZE, SIZE))
MASK[8:24, 8:24] = 1
TRUTH = Truth(MASK[..., None] * FACE + (1 - MASK[..., None]) * ROOM, MASK, None, ROOM)


def rendering(alpha: np.ndarray, colour: np.ndarray = FACE) -> Rendering:
    return Rendering((alpha[..., None] * colour).astype(np.float32), alpha.astype(np.float32))


def scores(asset: Rendering, truth: Truth = TRUTH, kind: MatteKind = "true") -> Values:
    both, pictures = dict.fromkeys(("model", "asset"), asset), dict.fromkeys(("model", "asset"), shown(asset.rgb))
    return score_renderings(both, pictures, truth, kind, Perceptual())["asset"]


def test_a_true_rendering_is_perfect_over_the_plate_and_poor_over_black() -> None:
    found = scores(rendering(MASK))
    assert (found["psnr_over_plate"], found["psnr_band_over_plate"]) == (MAX_PSNR, MAX_PSNR)
    assert found["ssim_over_plate"] == pytest.approx(1)
    assert found["psnr"] is not None and found["psnr"] < 10
    assert (found["psnr_interior"], found["psnr_band"], found["matte_sad"]) == (MAX_PSNR, MAX_PSNR, 0)


def test_painting_the_room_wrongly_costs_over_the_plate_alone() -> None:
    veil = np.where(MASK > 0, 1.0, 0.5)
    found = scores(rendering(veil, np.where(MASK[..., None] > 0, FACE, 0)))
    assert found["psnr_subject"] == MAX_PSNR
    assert found["psnr_over_plate"] is not None and found["psnr_over_plate"] < 15
    assert found["matte_sad"] == pytest.approx(0.5 * (SIZE**2 - 256) / 1000)


def test_a_halo_is_along_the_outline_not_inside() -> None:
    alpha = np.zeros_like(MASK)
    alpha[6:26, 6:26] = 1
    found = scores(rendering(alpha, np.where(MASK[..., None] > 0, FACE, 0)))
    assert found["psnr_interior"] == MAX_PSNR
    assert found["psnr_band"] == MAX_PSNR  # without a plate nobody knows what is out there
    assert found["psnr_band_over_plate"] is not None and found["psnr_band_over_plate"] < 20


def test_without_a_plate_nothing_is_over_it() -> None:
    """And with true masks nothing else is gone by."""
    found = scores(rendering(MASK), replace(TRUTH, plate=None, matte=np.ones_like(MASK)))
    assert [found[name] for name in ("psnr_over_plate", "ssim_over_plate", "psnr_band_over_plate")] == [None] * 3
    assert [found[name] for name in FOUND_METRICS] == [None] * len(FOUND_METRICS)


def test_without_masks_the_matte_that_was_found_says_where_the_subject_is() -> None:
    found = scores(rendering(MASK), replace(TRUTH, mask=None), "found")
    assert found["psnr_found"] == MAX_PSNR
    assert (found["psnr_subject"], found["matte_iou"], found["psnr_interior"]) == (None, None, None)


def test_a_matte_of_the_scene_does_not_depend_on_the_model() -> None:
    half = MASK.copy()
    half[:, :16] = 0
    wrong_left = FACE.copy()
    wrong_left[:, :16] = 1 - FACE[:, :16]
    truth = replace(TRUTH, mask=None, matte=half)
    found = scores(rendering(MASK, wrong_left), truth, "scene")
    assert found["psnr_found"] == MAX_PSNR
    assert scores(rendering(MASK, wrong_left), truth, "found")["psnr_found"] < 12  # type: ignore[operator]
