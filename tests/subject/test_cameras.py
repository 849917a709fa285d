"""What single cameras do differently: gains and errors in closed form, and what follows from them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.subject.cameras import MAX_ERROR_RATIO, MIN_GAIN_SPREAD, CameraFit, camera_errors, camera_gains
from facefolds_core.training.explicit.cameras import choose_cameras
from tests.scenes import OPAQUE, cameras_alike, make_scene

COUNT, EACH = 6, 400


def rays() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Colours (R, 3), opacity (R,), camera (R,): all rays of all cameras on the subject."""
    shown = np.random.default_rng(0).uniform(0.1, 0.6, (COUNT * EACH, 3)).astype(np.float32)
    return shown, np.ones(len(shown), np.float32), np.repeat(np.arange(COUNT, dtype=np.int32), EACH)


DRAWN = np.random.default_rng(1).uniform(0.7, 1.3, (COUNT, 3))
GAINS = DRAWN / DRAWN.mean(0)


def test_gains_are_found_and_their_mean_is_one() -> None:
    """Some wrong rays change little."""
    shown, alpha, camera = rays()
    seen = shown * GAINS[camera].astype(np.float32)
    found = camera_gains(shown, alpha, seen, camera, COUNT)
    # Drawn towards 1 by DARK^2 over the mean square: 0.3 %.
    np.testing.assert_allclose(found, GAINS, rtol=0.005)
    np.testing.assert_allclose(found.mean(0), 1)
    seen[::7] = 1.0
    np.testing.assert_allclose(camera_gains(shown, alpha, seen, camera, COUNT), GAINS, rtol=0.01)


def test_what_is_behind_does_not_count() -> None:
    shown, alpha, camera = rays()
    alpha[::2] = 0.9
    seen = shown.copy()
    seen[::2] = 0
    assert camera_gains(shown, alpha, seen, camera, COUNT) == pytest.approx(np.ones((COUNT, 3)))


def test_a_camera_that_sees_nothing_is_believed() -> None:
    shown, alpha, camera = rays()
    alpha[camera == 2] = 0
    assert camera_gains(shown, alpha, 0.5 * shown, camera, COUNT)[2] == pytest.approx(2 * np.ones(3), rel=0.2)
    assert np.isnan(camera_errors(shown, alpha, shown, camera, COUNT)[2])


def test_small_differences_are_left_alone() -> None:
    shown, alpha, camera = rays()
    gains = 1 + MIN_GAIN_SPREAD * 0.5 * np.repeat([[1.0], [-1.0]], 3, 0).repeat(3, 1)
    fit = CameraFit.of(shown, alpha, shown * gains.astype(np.float32)[camera], camera, COUNT)
    assert np.array_equal(fit.gains, np.ones((COUNT, 3))) and fit.measured == pytest.approx(gains, rel=1e-2)


def test_errors_are_told_without_the_gains() -> None:
    shown, alpha, camera = rays()
    fit = CameraFit.of(shown, alpha, shown * GAINS[camera].astype(np.float32), camera, COUNT)
    np.testing.assert_allclose(fit.gains, GAINS, rtol=0.01)
    assert fit.errors.max() < 0.01


def test_one_camera_far_off_is_left_out_by_name_and_cameras_alike_change_nothing(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", OPAQUE, size=12)
    errors = np.full(COUNT, 0.05)
    errors[3] = 0.05 * MAX_ERROR_RATIO * 1.1
    choice = choose_cameras(scene, replace(cameras_alike(COUNT), errors=errors))
    # Training cameras are 0, 1, 2, 4, 5, 6.
    assert choice.scene.indices("train") == [0, 1, 2, 5, 6] and choice.scene.indices("holdout") == [3]
    assert [(n.kind, n.camera) for n in choice.notes] == [("camera_contradicts", "cam4")]
    assert choice.gains.shape == (5, 3)
    summary = choice.summary["cam4"]
    assert isinstance(summary, dict) and summary["used"] is False
    choice = choose_cameras(scene, cameras_alike(COUNT))
    assert choice.scene.splits == scene.splits and choice.notes == ()
    assert (choice.gains == 1).all()
