"""Takes whose layers are trained with a reflection: their frames are fitted with it, too."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Literal
from unittest.mock import patch

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.track import Track
from facefolds_core.params import ExplicitParams, ReflectionParams
from facefolds_core.training.explicit.reflection_maps import Maps
from facefolds_core.training.explicit.views import Views, trace_views
from facefolds_core.training.segments.base import Base
from facefolds_core.training.segments.frames import FrameFitter
from facefolds_core.training.segments.loop import base_of, train_take
from facefolds_core.training.segments.plan import plan_take
from tests.geometry.test_track import about
from tests.training.takes import FRAMES, filmed, params
from tests.training.test_workers import files

pytestmark = pytest.mark.slow


def lit(begin: Literal["rounds", "end"] = "rounds", **segments: object) -> ExplicitParams:
    reflection = ReflectionParams(texels=4, environment_texels=4, begin=begin)
    return params(**segments).model_copy(update={"reflection": reflection})


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Path, Base]:
    """A take, and its base, which is given a reflection whether it helps or not."""
    folder = tmp_path_factory.mktemp("lit")
    scene = filmed(folder / "scene")
    with patch("facefolds_core.training.explicit.gloss.gain_on_cameras", lambda *_: 1.0):
        base = base_of(plan_take(scene, lit(), 2), scene, lit(), folder / "checkpoints" / "take", folder / "log")
    assert base.textures.reflection is not None and float(base.textures.reflection.environment.detach().max()) > 0
    return scene, folder, base


def test_frames_of_a_still_head_are_lit_as_the_base_is(made: tuple[Scene, Path, Base]) -> None:
    scene, _, base = made
    views = trace_views(scene, base.manifolds, 1)
    fitter = FrameFitter(scene, base, lit(), views)
    assert base.textures.reflection is not None
    expected = Maps.of(base.textures.reflection).on_rays(views)
    assert np.abs(expected).max() > 0
    np.testing.assert_array_equal(fitter.state.shine, expected)
    assert len(FrameFitter(scene, base, lit("end"), views).state.shine) == 0


def test_frames_of_a_turning_head_are_lit_as_it_stands(made: tuple[Scene, Path, Base]) -> None:
    scene, _, base = made
    turns = Track.of([about((0, 0, 1), 8.0 * k) for k in range(FRAMES)], np.zeros((FRAMES, 3)))
    turning = replace(scene, poses=turns)
    fitter, turned = FrameFitter(turning, base, lit()), list[object]()
    original = Maps.on_rays

    def on_rays(self: Maps, views: Views, turn: np.ndarray | None = None) -> np.ndarray:
        turned.append(turn)
        return original(self, views, turn)

    with patch.object(Maps, "on_rays", on_rays):
        fitter.fit(3, np.array([0.5, 0.5]), b"12345678")
    followed = 2  # which texels lag is asked of all rays, and which rays they concern
    assert len(turned) == lit().segments.steps + followed
    assert all(np.allclose(turn, turns.at(3).rotation) for turn in turned)  # type: ignore[arg-type]


def test_processes_make_the_same_files_with_a_reflection_too(made: tuple[Scene, Path, Base], tmp_path: Path) -> None:
    scene, folder, _ = made
    for processes in (1, 2):
        place = tmp_path / str(processes)
        shutil.copytree(folder / "checkpoints", place / "checkpoints")
        train_take(scene, lit(processes=processes), place / "model", place / "checkpoints", place / "log")
    assert files(tmp_path / "1") == files(tmp_path / "2")
