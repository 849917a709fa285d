"""The Arrow frame store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore, Image, write_frames
from tests.memory import peak_of

SHAPE = (5, 4, 3)


def image(seed: int) -> Image:
    return np.random.default_rng(seed).integers(0, 256, SHAPE, dtype=np.uint8)


@pytest.mark.parametrize("packed", [False, True])
def test_images_come_back_in_any_order_and_incomplete(packed: bool, tmp_path: Path) -> None:
    rows = [(2, 1, image(21)), (0, 0, image(0)[::-1]), (2, 0, image(20))]  # one of them a slice with strides
    write_frames(tmp_path / "f.arrow", SHAPE, rows, packed)
    store = FrameStore(tmp_path / "f.arrow")
    assert (store.height, store.width, store.channels) == SHAPE
    assert store.keys() == [(0, 0), (2, 0), (2, 1)]
    assert (0, 1) not in store
    assert np.array_equal(store.image(2, 1), image(21))
    assert np.array_equal(store.image(0, 0), image(0)[::-1])


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


def test_a_part_is_numbered_from_0_on(tmp_path: Path) -> None:
    write_frames(tmp_path / "f.arrow", SHAPE, [(1, k, image(k)) for k in range(4)])
    part = FrameStore(tmp_path / "f.arrow").part([3, 1])
    assert part.keys() == [(1, 0), (1, 1)]
    assert np.array_equal(part.image(1, 0), image(3))


@pytest.mark.parametrize("packed", [False, True])
def test_an_image_more_costs_a_store_hardly_any_memory(packed: bool, tmp_path: Path) -> None:
    dot = np.zeros((1, 1, 1), np.uint8)
    write_frames(tmp_path / "f.arrow", (1, 1, 1), [(0, k, dot) for k in range(1000)], packed)
    assert peak_of(lambda: FrameStore(tmp_path / "f.arrow")) < 200_000  # seen 80 000


def smooth(k: int) -> Image:
    return np.cumsum(np.full((64, 64, 4), 1 + k, np.uint8), axis=1, dtype=np.uint8)


def test_packed_images_are_what_they_were_in_any_order(tmp_path: Path) -> None:
    images = {(n, k): image(n + 3 * k) for n in range(2) for k in range(30)}
    write_frames(tmp_path / "f.arrow", SHAPE, [(n, k, images[n, k]) for k in range(30) for n in range(2)], packed=True)
    store = FrameStore(tmp_path / "f.arrow")
    for key in [*images, *reversed(images), (0, 17), (0, 17), (1, 3), (0, 29), (0, 1)]:
        assert np.array_equal(store.image(*key), images[key])


NOISE = np.random.default_rng(0).integers(0, 256, (64, 64, 4), dtype=np.uint8)


@pytest.mark.parametrize(("images", "share"), [([NOISE] * 24, 8), ([smooth(k) for k in range(4)], 5)])
def test_what_hardly_changes_or_is_smooth_is_packed_small(tmp_path: Path, images: list[Image], share: int) -> None:
    for packed in (False, True):
        rows = ((0, k, one) for k, one in enumerate(images))
        write_frames(tmp_path / f"{packed}.arrow", (64, 64, 4), rows, packed)
    plain, small = ((tmp_path / f"{packed}.arrow").stat().st_size for packed in (False, True))
    assert small < plain / share
    assert np.array_equal(FrameStore(tmp_path / "True.arrow").image(0, 3), images[3])


def test_what_is_packed_wrongly_is_named_when_it_is_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "f.arrow"
    write_frames(path, (64, 64, 4), [(0, k, smooth(k)) for k in range(2)], packed=True)
    content = path.read_bytes()
    start = content.index(bytes.fromhex("28b52ffd"))  # Zstandard's first bytes
    path.write_bytes(content[:start] + bytes(4) + content[start + 4 :])
    with pytest.raises(UserError, match="damaged frame store") as caught:
        FrameStore(path).image(0, 0)
    assert caught.value.place == "index 0, frame 0"
