"""Pixels at outlines have four rays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene
from facefolds_core.training.explicit.teacher import Teacher
from facefolds_core.training.explicit.views import Views, trace_views
from tests.scenes import make_scene
from tests.subject.splats import found
from tests.training.test_moving import layers


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return make_scene(tmp_path / "scene", size=24, mattes=True)


def traced(scene: Scene, stride: int) -> Views:
    return trace_views(scene, layers(), stride)


def test_four_rays_at_outlines_around_the_centres_and_one_elsewhere(scene: Scene) -> None:
    views, mattes = traced(scene, 1), scene.open_mattes()
    assert mattes is not None
    several = 0
    for camera, index in enumerate(scene.indices("train")):
        own = views.camera == camera
        shown = np.stack([mattes.image(index, k)[..., 0] for k in range(scene.num_frames)]).astype(int)
        near = np.pad(shown, ((0, 0), (1, 1), (1, 1)), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(near, (3, 3), (1, 2))
        outline = (windows.max((-1, -2)) - windows.min((-1, -2)) > 8).any(0).ravel()
        np.testing.assert_array_equal(views.which[own] >= 0, outline[views.pixel[own]])
        several += int(outline[views.pixel[own]].sum())
    assert 0 < several == len(views.finer) < len(views.which)
    fine = views.which >= 0
    whole = (views.codes[fine][..., 0] > 0) & (views.finer[views.which[fine]][..., 0] > 0).all(1)
    means = views.finer[views.which[fine]].mean(1)
    assert whole.any()
    # A pixel is some 3000 codes; surfaces that are seen along them curve.
    assert np.median(np.abs(means - views.codes[fine])[whole]) < 300
    assert np.ptp(views.finer[views.which[fine]].astype(int), axis=1)[whole].min() > 0
    assert (traced(scene, 3).which < 0).all()  # in rounds of geometry


def test_parts_and_what_is_put_together_keep_their_rays(scene: Scene) -> None:
    views = traced(scene, 1)
    order = np.random.default_rng(0).permutation(len(views.which))
    again = Views.together([views.part(order[:50]), views.part(order[50:])]).part(np.argsort(order))
    for name in ("codes", "camera", "pixel", "directions"):
        np.testing.assert_array_equal(getattr(again, name), getattr(views, name))
    np.testing.assert_array_equal(again.which < 0, views.which < 0)
    fine = views.which >= 0
    np.testing.assert_array_equal(again.finer[again.which[fine]], views.finer[views.which[fine]])


def test_virtual_cameras_have_fewer_pixels_and_finer_rays_at_their_outlines(scene: Scene) -> None:
    teacher = Teacher(scene, found(scene, 30.0), seed=0).virtual
    plain, views = traced(scene, 1), trace_views(scene, layers(), 1, teacher)
    real = len(scene.indices("train"))
    photos = views.part(np.flatnonzero(views.camera < real))
    for name, array in vars(plain).items():
        np.testing.assert_array_equal(getattr(photos, name), array)
    own = np.flatnonzero(views.camera >= real)
    assert set(views.camera[own]) == set(range(real, real + len(teacher.cameras)))
    assert len(own) <= len(photos.pixel) * 1.2 and (views.which[own] >= 0).any()
