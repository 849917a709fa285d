"""The Arrow frame store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.frame_store import FrameStore, Image, write_frames

SHAPE = (5, 4, 3)


def image(seed: int) -> Image:
    return np.random.default_rng(seed).integers(0, 256, SHAPE, dtype=np.uint8)


def test_images_come_back_in_any_order_and_incomplete(tmp_path: Path) -> None:
    write_frames(tmp_path / "f.arrow", SHAPE, [(2, 1, image(21)), (0, 0, image(0)), (2, 0, image(20))])
    store = FrameStore(tmp_path / "f.arrow")
    assert store.keys() == [(0, 0), (2, 0), (2, 1)]
    assert (0, 1) not in store
    assert np.array_equal(store.image(2, 1), image(21))


def test_shape_is_that_of_the_images(tmp_path: Path) -> None:
    write_frames(tmp_path / "f.arrow", SHAPE, [(0, 0, image(0))])
    store = FrameStore(tmp_path / "f.arrow")
    assert (store.height, store.width, store.channels) == SHAPE


def test_a_slice_with_strides_is_stored_right(tmp_path: Path) -> None:
    flipped = image(0)[::-1]
    write_frames(tmp_path / "f.arrow", SHAPE, [(0, 0, flipped)])
    assert np.array_equal(FrameStore(tmp_path / "f.arrow").image(0, 0), flipped)


@pytest.mark.parametrize("wrong", [image(0)[:4], image(0).astype(np.float32)])
def test_an_image_of_another_shape_or_type_leaves_no_file(tmp_path: Path, wrong: Image) -> None:
    with pytest.raises(ValueError, match="expected uint8"):
        write_frames(tmp_path / "f.arrow", SHAPE, [(0, 0, image(0)), (0, 1, wrong)])
    assert list(tmp_path.iterdir()) == []


def test_a_missing_store_is_the_users_to_mend(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="file not found"):
        FrameStore(tmp_path / "f.arrow")


@pytest.mark.parametrize("keep", [0, 7, 300, -40])
def test_a_truncated_store_is_refused(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "f.arrow"
    write_frames(path, SHAPE, [(0, k, image(k)) for k in range(3)])
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(UserError, match="damaged frame store"):
        FrameStore(path)
