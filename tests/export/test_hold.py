"""Texels kept still: the weights are squared derivatives of the rendering, the minimum is one, and extremes hold."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import torch

from facefolds_core.export.hold import held_rows, parts, shown_rays, texel_weights
from facefolds_core.export.hold_kernel import add_weights, hold, pieces
from facefolds_core.export.kept import KeptFrames
from facefolds_core.files.frame_store import FrameStore, write_frames
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.kernels.hit_codes import SCALE
from facefolds_core.model.compositing import compositing_weights
from tests.scenes import look_at_origin
from tests.training.reference import look_up


def kept(y: Sequence[float] | np.ndarray, price: float) -> np.ndarray:
    """Of y (K, Q), or of one channel."""
    x = np.array(y, np.float64).reshape(len(y), -1)
    pieces(x, price, np.empty(len(x) + 1), np.empty(len(x), np.int64))
    return x.reshape(np.shape(y))


def best_of_all(y: np.ndarray, price: float) -> np.ndarray:
    """y (K, Q): every way to cut it into pieces is tried."""

    def constant(cuts: tuple[int, ...]) -> np.ndarray:
        parts = np.split(y, cuts)
        return np.concatenate([np.repeat(part.mean(0, keepdims=True), len(part), 0) for part in parts])

    def cost(cuts: tuple[int, ...]) -> float:
        return float(0.5 * ((constant(cuts) - y) ** 2).sum() + price * len(cuts))

    inner = range(1, len(y))
    return constant(min((cuts for count in range(len(y)) for cuts in combinations(inner, count)), key=cost))


@pytest.mark.parametrize("seed", range(20))
def test_the_minimum_is_that_of_all_pieces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    y = rng.normal(0, 10, (rng.integers(1, 10), rng.integers(1, 4)))
    price = float(rng.uniform(1, 300))
    assert kept(y, price) == pytest.approx(best_of_all(y, price))


def test_nothing_is_held_for_nothing_and_all_at_any_price() -> None:
    y = [3.0, 9.0, 1.0, 7.0]
    assert kept(y, 0.0) == pytest.approx(y)
    assert kept(y, 1e9) == pytest.approx([5.0] * 4)
    assert kept(y[:1], 4.0) == pytest.approx(y[:1])


def test_a_blink_of_one_frame_is_kept_whole() -> None:
    """What trembles beside it keeps still."""
    assert kept([10, 11, 10, 11, 90, 10, 11, 10], 8.0) == pytest.approx([10.5] * 4 + [90] + [31 / 3] * 3)


def test_weights_bound_what_errors_of_all_layers_do() -> None:
    """One ray in the middle of a texel of each of three layers: its share is 1, the derivatives a picture's."""
    rng = np.random.default_rng(1)
    texture = rng.uniform(30, 200, (3, 5, 5, 4)).astype(np.float32)
    codes = np.full((1, 3, 2), round(1 + 65534 * 0.5), np.uint16)
    weights = np.zeros((3, 5, 5, 2), np.float32)
    add_weights(codes, texture, weights, 0.001)

    def colour(layer: int, channel: int, change: float) -> np.ndarray:
        moved = texture.copy()
        moved[layer, :, :, channel] += change
        seen = look_up(torch.tensor(codes.astype(np.int32)), torch.tensor(moved.transpose(1, 2, 0, 3) / 255))
        weights, _ = compositing_weights(seen[..., 3])
        return np.asarray((weights[..., None] * seen[..., :3]).sum(1)[0]) * 255

    def derivative(layer: int, channel: int) -> np.ndarray:
        return np.asarray(colour(layer, channel, 10) - colour(layer, channel, -10)) / 20

    by_red = np.array([derivative(layer, 0)[0] for layer in range(3)])
    by_alpha = np.array([np.sqrt((derivative(layer, 3) ** 2).mean()) for layer in range(3)])
    assert weights[:, 2, 2, 0] == pytest.approx(by_red * by_red.sum(), rel=2e-2)
    assert weights[:, 2, 2, 1] == pytest.approx(by_alpha * by_alpha.sum(), rel=2e-2)


def test_rays_that_may_show_anything_are_kept() -> None:
    """A square before the camera, opaque in its left half: codes say where rays meet it."""
    square = np.array([[0, -0.1, 0.1], [0, 0.1, 0.1], [0, 0.1, -0.1], [0, -0.1, -0.1]], np.float32)
    st = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    mesh = TexturedMesh(square, np.array([[0, 2, 1], [0, 3, 2]], np.int32), st)
    opacity = np.zeros((1, 64, 64), np.uint8)
    opacity[:, :, :32] = 255
    codes = shown_rays([look_at_origin("front", 0, 0, 64)], [mesh], opacity)
    places = (codes[:, 0].astype(float) - 1) / SCALE
    assert len(codes) > 50 and 0.45 < places[:, 0].max() < 0.53 and places[:, 1].max() > 0.9
    nothing = shown_rays([look_at_origin("front", 0, 0, 64)], [mesh], np.zeros_like(opacity))
    assert nothing.shape == (0, 1, 2)


@pytest.mark.parametrize("memory", [1 << 20, 8 * 16 * 4 * 3, 1])
def test_what_shows_moves_and_what_does_not_stays(memory: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A trembling layer behind an opaque one becomes constant; the one in front, much looked at, stays as it is."""
    rng = np.random.default_rng(2)
    textures = rng.integers(100, 110, (2, 8, 16, 16, 4)).astype(np.uint8)
    textures[0, ..., 3] = 255
    path = tmp_path / "textures.arrow"
    write_frames(path, (16, 16, 4), ((n, k, textures[n, k]) for n in range(2) for k in range(8)))
    codes = np.repeat(rng.integers(1, 65536, (30_000, 1, 2)), 2, 1).astype(np.uint16)
    store = FrameStore(path)
    weights = texel_weights(codes, store, 1)
    found = np.empty_like(textures)
    monkeypatch.setattr("facefolds_core.export.hold.MEMORY", memory)
    for layer, frame, image in held_rows(store, weights, 1.0, tmp_path, KeptFrames(None)):
        found[layer, frame] = image
    assert [p.name for p in tmp_path.iterdir()] == ["textures.arrow"]
    assert (found[0] == textures[0]).mean() > 0.99
    assert (found[1] == found[1, :1]).all()
    assert np.abs(found[1, 0] - textures[1].mean(0)).max() <= 0.5


@pytest.mark.parametrize(("count", "window"), [(1, 96), (96, 96), (97, 96), (500, 96), (11, 4), (7, 6)])
def test_each_frame_is_held_once_among_those_around_it(count: int, window: int) -> None:
    found = parts(count, window)
    assert [k for own, _ in found for k in own] == list(range(count))
    assert all(len(around) <= window for _, around in found)
    margin = window // 4
    for own, around in found if count > window else []:
        assert around.start == max(0, own.start - margin)
        assert around.stop == min(count, own.stop + margin)


def held(images: np.ndarray, folder: Path, window: int, keep: Path | None = None, weight: float = 0.2) -> np.ndarray:
    """One layer of images (K, 8, 8, 4)."""
    write_frames(folder / "t.arrow", (8, 8, 4), ((0, k, one) for k, one in enumerate(images)))
    weights, store = np.full((1, 8, 8, 2), weight, np.float32), FrameStore(folder / "t.arrow")
    kept = KeptFrames(keep)
    with patch("facefolds_core.export.hold.WINDOW", window):
        rows = list(held_rows(store, weights, 1.0, folder, kept))
    write_frames(folder / "held.arrow", (8, 8, 4), rows, packed=True)
    kept.keep(folder / "held.arrow")
    return np.stack([image for _, _, image in rows])


def test_a_frame_that_changes_changes_only_those_near_it(tmp_path: Path) -> None:
    images = np.random.default_rng(3).integers(100, 104, (64, 8, 8, 4)).astype(np.uint8)
    other = images.copy()
    other[40] += 50
    for window, touched in ((64, range(64)), (16, range(32, 48))):
        changed = (held(images, tmp_path, window) != held(other, tmp_path, window)).any((1, 2, 3))
        assert set(np.flatnonzero(changed)) <= set(touched)
    whole = (held(images, tmp_path, 64) != held(other, tmp_path, 64)).any((1, 2, 3))
    assert whole.sum() > 16  # at once it would reach farther


def test_what_keeps_still_hardly_moves_where_windows_meet(tmp_path: Path) -> None:
    images = np.random.default_rng(4).integers(98, 107, (64, 8, 8, 4)).astype(np.uint8)
    steps = np.abs(np.diff(held(images, tmp_path, 32, weight=0.02).astype(int), axis=0))
    assert np.abs(np.diff(images.astype(int), axis=0)).mean() > 2
    assert steps[15::16].mean() < 0.5  # of codes; seen 0.3


def test_parts_that_would_be_the_same_are_taken_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = list[int]()

    def counted(block: np.ndarray, weights: np.ndarray, price: float) -> None:
        made.append(len(block))
        hold(block, weights, price)

    monkeypatch.setattr("facefolds_core.export.hold.hold", counted)
    images = np.random.default_rng(5).integers(100, 104, (64, 8, 8, 4)).astype(np.uint8)
    other = images.copy()
    other[40] += 50

    def runs(shown: np.ndarray, weight: float = 0.2) -> int:
        made.clear()
        found = held(shown, tmp_path, 16, tmp_path / "kept", weight)
        count = len(made)
        assert np.array_equal(found, held(shown, tmp_path, 16, weight=weight))
        return count

    assert runs(images) == 8
    assert runs(images) == 0
    assert runs(other) == 2  # frame 40 is the first of a part, and looked at by the part before
    assert runs(other, weight=0.3) == 8
