"""Frames of an earlier run are taken over where they would be the same, and only there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.export.kept import INDEX, STORE, KeptFrames, digest_of
from facefolds_core.files.frame_store import FrameStore, Image, write_frames

LAYERS, FRAMES = 2, 3


def image(layer: int, frame: int) -> Image:
    return np.random.default_rng(10 * layer + frame).integers(0, 256, (8, 8, 4), dtype=np.uint8)


def source(path: Path, changed: int | None = None) -> FrameStore:
    """Images of two layers and three frames; those of one frame others."""
    rows = [(n, k, image(n, k + 7 * (k == changed))) for n in range(LAYERS) for k in range(FRAMES)]
    write_frames(path, (8, 8, 4), rows, packed=True)
    return FrameStore(path)


@pytest.mark.parametrize("value", [np.array([1.5, 2.0]), np.array([[1.5], [2.5]]), "text", (1, 2)])
def test_a_digest_tells_values_apart(value: object) -> None:
    assert digest_of({"a": value}) == digest_of({"a": value})
    assert digest_of({"a": value}) != digest_of({"a": np.array([1.5, 2.5])})


def grouped(folder: Path, changed: int | None = None) -> tuple[list[tuple[int, int]], list[Image]]:
    """(first frame, layer) of what is made, and all images; each group of two frames is made of all its frames."""
    store, kept, made = source(folder / "in.arrow", changed), KeptFrames(folder / "kept"), list[tuple[int, int]]()

    def make(frames: Sequence[int], layer: int) -> list[Image]:
        made.append((frames[0], layer))
        return [255 - store.image(layer, frame) for frame in frames]

    def digest(frames: Sequence[int]) -> str:
        return digest_of({f"{n} {k}": store.image(n, k) for n in range(LAYERS) for k in frames}).hex()

    rows = kept.groups([[0, 1], [2]], range(LAYERS), digest, make)
    write_frames(folder / "out.arrow", (8, 8, 4), rows, packed=True)
    kept.keep(folder / "out.arrow")
    out = FrameStore(folder / "out.arrow")
    return made, [out.image(n, k) for k in range(FRAMES) for n in range(LAYERS)]


def test_groups_are_taken_over_whole(tmp_path: Path) -> None:
    made, images = grouped(tmp_path)
    assert made == [(0, 0), (0, 1), (2, 0), (2, 1)]
    again, same = grouped(tmp_path)
    assert again == []
    assert np.array_equal(images, same)
    assert grouped(tmp_path, changed=1)[0] == [(0, 0), (0, 1)]


@pytest.mark.parametrize("name", [STORE, INDEX])
def test_what_is_damaged_is_made_anew(name: str, tmp_path: Path) -> None:
    _, images = grouped(tmp_path)
    path = tmp_path / "kept" / name
    content = path.read_bytes()
    path.unlink()  # it is a link
    path.write_bytes(content[: len(content) // 2])
    made, same = grouped(tmp_path)
    assert len(made) == 4
    assert np.array_equal(images, same)
