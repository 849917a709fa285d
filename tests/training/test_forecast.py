"""What a training will take, told before it begins."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams
from facefolds_core.training.segments.forecast import Forecast, check_forecast, forecast
from tests.scenes import look_at_origin, make_scene


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return make_scene(tmp_path_factory.mktemp("forecast") / "scene", size=24)


def take(scene: Scene, frames: int, size: int = 24) -> Scene:
    cameras = tuple(look_at_origin(f"c{i}", 10.0 * i, 0, size) for i in range(24))
    ids = tuple(f"{k:06d}" for k in range(frames))
    return replace(scene, cameras=cameras, splits=("train",) * 24, frame_ids=ids, times=np.arange(frames) / 30)


def params(**segments: object) -> ExplicitParams:
    return ExplicitParams.model_validate({"segments": segments})


@pytest.mark.parametrize(("frames", "size", "keys"), [(24, 24, None), (25, 24, 12), (24, 1500, 3), (10, 750, None)])
def test_long_takes_and_large_ones_are_trained_in_segments(
    scene: Scene, frames: int, size: int, keys: int | None
) -> None:
    assert forecast(take(scene, frames, size), params()).key_frames == keys


def test_memory_does_not_grow_with_the_take_and_time_and_disk_do(scene: Scene) -> None:
    short, long = (forecast(take(scene, frames, 600), params()) for frames in (60, 960))
    assert long.memory == short.memory
    assert 8 < long.disk / short.disk < 16
    assert 8 < long.seconds / short.seconds < 17
    fine = ExplicitParams.model_validate({"textures": {"pixels_per_texel": 0.5}})
    assert 3 < forecast(take(scene, 960, 600), fine).seconds / long.seconds < 4.5


def test_what_cannot_fit_is_refused_with_numbers(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="memory") as caught:
        check_forecast(Forecast(3, 10**15, 0, 1.0), params(), None)
    assert "1000000.0 GB" in str(caught.value)
    with pytest.raises(UserError, match="disk"):
        check_forecast(Forecast(3, 0, 10**18, 1.0), params(), tmp_path / "model")


def test_it_is_told_in_words() -> None:
    told = str(Forecast(24, 4_000_000_000, 3_600_000_000, 600.0))
    assert all(part in told for part in ("24 key frames", "10 minutes", "4.0 GB of memory", "3.60 GB on the disk"))
