"""Texture frames between frames: what was there stays, what moves is moved, and what cannot be matched is mixed."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from facefolds_core.export.between import at_frame_rate, between_rows, crowd, dense_flow, motions, sources
from facefolds_core.frame_store import FrameStore
from tests.assets import write_store

SIZE = 64
Image = NDArray[np.uint8]


def pattern(shift: float, size: int = SIZE) -> Image:
    """(size, size, 4): a smooth pattern without repetition, `shift` texels to the right; alpha from 55 to 255."""
    row, column = np.mgrid[:size, :size].astype(float)
    x = column - shift
    waves = [np.sin(x / 4.1 + row / 9), np.sin(x / 6.3 - row / 5.2), np.cos(x / 5 + row / 13), np.sin(x / 11 + row / 7)]
    low, high = (30, 30, 30, 55), (225, 225, 225, 255)
    planes = [a + (b - a) * (0.5 + 0.5 * wave) for wave, a, b in zip(waves, low, high, strict=True)]
    return np.rint(np.stack(planes, -1)).astype(np.uint8)


def store_of(folder: Path, textures: NDArray[np.uint8]) -> FrameStore:
    """A store of (K, N, S, S, 4)."""
    return write_store(folder / "textures.arrow", textures)


def rows_of(store: FrameStore, factor: int) -> dict[tuple[int, int], Image]:
    return {(layer, frame): image for layer, frame, image in between_rows(store, factor, progress=False)}


def moving(folder: Path, step: float, frames: int = 3) -> FrameStore:
    return store_of(folder, np.stack([pattern(step * k)[None] for k in range(frames)]))


def inner(image: Image) -> NDArray[np.float64]:
    """Premultiplied, without a border into which something came from outside."""
    values = image[8:-8, 8:-8].astype(float) / 255
    values[..., :3] *= values[..., 3:]
    return values


@pytest.mark.parametrize("factor", [1, 2, 3])
def test_the_captures_frames_stay_as_they_are_and_the_last_is_held(tmp_path: Path, factor: int) -> None:
    textures = np.random.default_rng(0).integers(0, 256, (3, 2, SIZE, SIZE, 4), dtype=np.uint8)
    rows = rows_of(store_of(tmp_path, textures), factor)
    assert sorted(rows) == [(layer, frame) for layer in range(2) for frame in range(3 * factor)]
    for (layer, frame), image in rows.items():
        if frame % factor == 0 or frame > 2 * factor:
            np.testing.assert_array_equal(image, textures[frame // factor, layer])


@pytest.mark.parametrize(("factor", "step"), [(2, 2.0), (2, 5.0), (3, 3.0)])
def test_what_moves_is_in_between(tmp_path: Path, factor: int, step: float) -> None:
    store = moving(tmp_path, step)
    for (_, frame), image in rows_of(store, factor).items():
        if frame <= 2 * factor:
            truth = pattern(step * frame / factor)
            # Worst error seen: 0.011 (step 5); cross-fading has 0.05 (step 2) to 0.2 (step 5).
            assert np.sqrt(((inner(image) - inner(truth)) ** 2).mean()) < 0.015


def test_one_motion_serves_all_layers(tmp_path: Path) -> None:
    """A veil without a pattern of its own moves with what is seen through it: it stays a veil."""
    veil = np.full((SIZE, SIZE, 4), (200, 100, 50, 40), np.uint8)
    store = store_of(tmp_path, np.stack([[veil, pattern(4.0 * k)] for k in range(2)]))
    rows = rows_of(store, 2)
    np.testing.assert_allclose(rows[0, 1].astype(int), veil.astype(int), atol=1)
    assert np.sqrt(((inner(rows[1, 1]) - inner(pattern(2.0))) ** 2).mean()) < 0.02


@pytest.mark.parametrize("texel", [(90, 120, 30, 255), (0, 0, 0, 0), (255, 255, 255, 0)])
def test_a_texture_without_anything_to_see_stays_what_it_is(tmp_path: Path, texel: tuple[int, ...]) -> None:
    image = np.full((SIZE, SIZE, 4), texel, np.uint8)
    between = rows_of(store_of(tmp_path, np.stack([image[None]] * 2)), 2)[0, 1]
    assert (between[..., 3] == texel[3]).all()
    if texel[3]:
        np.testing.assert_array_equal(between, image)


def test_a_hidden_colour_does_not_bleed(tmp_path: Path) -> None:
    hidden, shown = (np.full((SIZE, SIZE, 4), texel, np.uint8) for texel in ((255, 0, 0, 0), (0, 200, 0, 200)))
    between = rows_of(store_of(tmp_path, np.stack([hidden[None], shown[None]])), 2)[0, 1]
    np.testing.assert_array_equal(between, np.full((SIZE, SIZE, 4), (0, 200, 0, 100), np.uint8))


class _Nan:
    @classmethod
    def create(cls, preset: int) -> _Nan:
        return cls()

    def calc(self, first: Image, second: Image, flow: None) -> NDArray[np.float32]:
        return np.full((*first.shape, 2), np.nan, np.float32)


def mixed(first: Image, second: Image) -> NDArray[np.float64]:
    """Premultiplied mean."""
    values = np.stack([first, second]).astype(float) / 255
    values[..., :3] *= values[..., 3:]
    return values.mean(0)


def test_without_a_finite_flow_frames_are_mixed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "DISOpticalFlow", _Nan)
    between = rows_of(moving(tmp_path, 4.0), 2)[0, 1].astype(float) / 255
    between[..., :3] *= between[..., 3:]
    np.testing.assert_allclose(between, mixed(pattern(0), pattern(4)), atol=1 / 255)


def test_pictures_too_small_for_a_flow_are_mixed(tmp_path: Path) -> None:
    textures = np.stack([pattern(k, 8)[None] for k in range(2)])
    between = rows_of(store_of(tmp_path, textures), 2)[0, 1].astype(float) / 255
    between[..., :3] *= between[..., 3:]
    np.testing.assert_allclose(between, mixed(*textures[:, 0]), atol=1 / 255)


def test_a_single_frame_is_held(tmp_path: Path) -> None:
    rows = rows_of(store_of(tmp_path, pattern(0)[None, None]), 2)
    np.testing.assert_array_equal(rows[0, 1], rows[0, 0])


def test_sources_of_a_stretch() -> None:
    """Texels at x go to x + (x - 32) / 4: the one at y was at 32 + 0.8 (y - 32), and they are 0.8 as dense along x."""
    row, column = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    found = sources(np.stack([(column - 32) / 4, 0 * row], -1))
    np.testing.assert_allclose(found[..., 0], 32 + 0.8 * (column - 32), atol=1e-2)
    np.testing.assert_allclose(found[..., 1], row, atol=1e-5)
    np.testing.assert_allclose(crowd(found)[4:-4, 4:-4], 0.8, atol=2e-2)


def test_flow_of_a_shift() -> None:
    first, second = (pattern(shift)[..., :3].mean(-1).astype(np.uint8) for shift in (0, 3))
    flow = dense_flow(first, second)[12:-12, 12:-12]
    np.testing.assert_allclose(flow.mean((0, 1)), (3, 0), atol=0.05)


def test_it_repeats_bit_for_bit_whatever_the_threads(tmp_path: Path) -> None:
    store, threads = moving(tmp_path, 2.5), cv2.getNumThreads()
    try:
        results = []
        for count in (1, 4):
            cv2.setNumThreads(count)
            results.append([motion.forward for motion in motions(store, 1, 3)])
            assert cv2.getNumThreads() == count
    finally:
        cv2.setNumThreads(threads)
    np.testing.assert_array_equal(*results)


class _Watched:
    """A store that notes which frames were looked at."""

    height = width = SIZE

    def __init__(self, frames: int) -> None:
        self.frames, self.seen = frames, 0

    def keys(self) -> list[tuple[int, int]]:
        return [(0, frame) for frame in range(self.frames)]

    def image(self, layer: int, frame: int) -> Image:
        self.seen = max(self.seen, frame)
        return pattern(frame)


def test_it_looks_one_frame_ahead_and_no_farther() -> None:
    store = _Watched(5)
    for _, frame, _ in between_rows(store, 2, progress=False):  # type: ignore[arg-type]
        assert store.seen <= frame // 2 + 1


def test_the_file_is_gone_afterwards(tmp_path: Path) -> None:
    store = moving(tmp_path, 1.0)
    with at_frame_rate(store, 2, tmp_path) as dense:
        assert len(dense.keys()) == 6
    with at_frame_rate(store, 1, tmp_path) as same:
        assert same is store
    assert [path.name for path in tmp_path.iterdir()] == ["textures.arrow"]
