"""Resampling of RGBA textures: closed forms and extremes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.export.textures import resample, resample_store
from facefolds_core.files.frame_store import FrameStore, write_frames


def constant(size: int, rgba: tuple[int, int, int, int]) -> np.ndarray:
    return np.tile(np.array(rgba, np.uint8), (size, size, 1))


def noise(size: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (size, size, 4), dtype=np.uint8)


@pytest.mark.parametrize("size", [8, 21, 32, 64])
@pytest.mark.parametrize("alpha", [0, 1, 77, 255])
def test_a_constant_stays_constant_and_what_is_clear_is_nothing(size: int, alpha: int) -> None:
    image, shown = constant(32, (10, 200, 99, alpha)), (10, 200, 99, alpha) if alpha else (0, 0, 0, 0)
    assert np.array_equal(resample(image, size), constant(size, shown))


def test_colours_are_averaged_by_alpha() -> None:
    image = np.zeros((2, 2, 4), np.uint8)
    image[0, 0] = (200, 0, 0, 255)
    image[0, 1] = (0, 100, 0, 85)
    # alpha (1 + 1/3) / 4 = 1/3; colour (200, 100 / 3, 0) / (4 / 3).
    assert resample(image, 1)[0, 0].tolist() == [150, 25, 0, 85]


def test_shrinking_to_a_size_that_does_not_divide_keeps_the_mean() -> None:
    image = noise(30)
    image[..., 3] = 255
    mean = resample(image, 7).reshape(-1, 4).mean(0)
    assert np.abs(mean - image.reshape(-1, 4).mean(0)).max() < 0.3  # rounding of 49 texels


def test_a_transparent_texel_does_not_bleed() -> None:
    image = constant(16, (50, 60, 70, 255))
    image[:, :3] = (255, 0, 255, 0)
    result = resample(image, 8)
    assert (result[result[..., 3] > 0][:, :3] == (50, 60, 70)).all()


def test_the_same_size_keeps_what_shows_and_clear_texels_take_the_colour_around_them() -> None:
    image = noise(33)
    image[5:20, 3:30, 3] = 0
    result = resample(image, 33)
    shown = image[..., 3] > 0
    assert np.array_equal(result[shown], image[shown])
    assert np.array_equal(result[..., 3], image[..., 3])
    image = constant(32, (10, 20, 30, 255))
    image[8:24, 8:24] = 0
    assert (resample(image, 32)[..., :3] == (10, 20, 30)).all()


def test_filled_colour_stays_between_its_sources() -> None:
    image = constant(32, (0, 0, 0, 0))
    image[:, :4] = (100, 100, 100, 255)
    image[:, -4:] = (200, 200, 200, 255)
    filled = resample(image, 32)[..., :3]
    assert filled.min() >= 100
    assert filled.max() <= 200
    assert (filled[:, 4] < filled[:, 27]).all()


def test_enlarging_interpolates() -> None:
    image = np.zeros((8, 8, 4), np.uint8)
    image[..., 3] = 255
    image[:, 4:, 0] = 200
    row = resample(image, 16)[8, :, 0].tolist()
    assert row == [0] * 7 + [50, 150] + [200] * 7


def write(path: Path, keys: list[tuple[int, int]], size: int = 8) -> None:
    write_frames(path, (size, size, 4), ((layer, frame, noise(size, 10 * layer + frame)) for layer, frame in keys))


def test_the_store_keeps_layers_and_frames(tmp_path: Path) -> None:
    write(tmp_path / "in.arrow", [(layer, frame) for frame in range(3) for layer in range(2)])
    resample_store(tmp_path / "in.arrow", tmp_path / "out.arrow", 4)
    out = FrameStore(tmp_path / "out.arrow")
    assert out.keys() == [(layer, frame) for layer in range(2) for frame in range(3)]
    assert np.array_equal(out.image(1, 2), resample(noise(8, 12), 4))


def test_a_store_that_lacks_an_image_or_is_cut_off_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    write(tmp_path / "in.arrow", [(0, 0), (1, 0), (0, 1)])
    with pytest.raises(UserError, match="not complete"):
        resample_store(tmp_path / "in.arrow", tmp_path / "out.arrow", 4)
    whole = (tmp_path / "in.arrow").read_bytes()
    (tmp_path / "in.arrow").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match="damaged"):
        resample_store(tmp_path / "in.arrow", tmp_path / "out.arrow", 4)
    assert [p.name for p in tmp_path.iterdir()] == ["in.arrow"]
