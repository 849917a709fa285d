"""Frames of an earlier run are taken over where they would be the same, and only there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.export.kept import INDEX, STORE, KeptFrames, digest_of, digest_of_frame
from facefolds_core.files.frame_store import FrameStore, Image, write_frames

LAYERS, FRAMES = 2, 3


def image(layer: int, frame: int) -> Image:
    return np.random.default_rng(10 * layer + frame).integers(0, 256, (8, 8, 4), dtype=np.uint8)


def source(path: Path, changed: int | None = None) -> FrameStore:
    """Images of two layers and three frames; those of one frame others."""
    rows = [(n, k, image(n, k + 7 * (k == changed))) for n in range(LAYERS) for k in range(FRAMES)]
    write_frames(path, (8, 8, 4), rows, packed=True)
    return FrameStore(path)


def run(folder: Path, store: FrameStore, common: bytes = b"same") -> tuple[list[int], list[Image]]:
    """The frames that are made, and all images; a made frame is the source's, inverted."""
    kept, made = KeptFrames(folder / "kept"), list[int]()

    def make(frame: int) -> Image:
        made.append(frame)
        return 255 - np.stack([store.image(n, frame) for n in range(LAYERS)])

    def digest(frame: int) -> str:
        return digest_of_frame(common, (store.image(n, frame) for n in range(LAYERS)))

    rows = kept.rows(range(FRAMES), LAYERS, digest, make, lambda: None)
    write_frames(folder / "out.arrow", (8, 8, 4), rows, packed=True)
    kept.keep(folder / "out.arrow")
    out = FrameStore(folder / "out.arrow")
    return made, [out.image(n, k) for k in range(FRAMES) for n in range(LAYERS)]


def test_what_is_the_same_is_taken_over(tmp_path: Path) -> None:
    first = run(tmp_path, source(tmp_path / "a.arrow"))
    second = run(tmp_path, source(tmp_path / "b.arrow"))
    assert (first[0], second[0]) == ([0, 1, 2], [])
    assert np.array_equal(first[1], second[1])


def test_a_changed_frame_alone_is_made_anew(tmp_path: Path) -> None:
    run(tmp_path, source(tmp_path / "a.arrow"))
    made, images = run(tmp_path, source(tmp_path / "b.arrow", changed=1))
    assert made == [1]
    assert np.array_equal(images[2], 255 - image(0, 8))


def test_with_other_input_all_are_made_anew(tmp_path: Path) -> None:
    run(tmp_path, source(tmp_path / "a.arrow"))
    assert run(tmp_path, source(tmp_path / "b.arrow"), common=b"other")[0] == [0, 1, 2]


@pytest.mark.parametrize("name", [STORE, INDEX])
def test_what_is_damaged_is_made_anew(name: str, tmp_path: Path) -> None:
    first = run(tmp_path, source(tmp_path / "a.arrow"))
    path = tmp_path / "kept" / name
    content = path.read_bytes()
    path.unlink()  # it is a link
    path.write_bytes(content[: len(content) // 2])
    made, images = run(tmp_path, source(tmp_path / "b.arrow"))
    assert made == [0, 1, 2]
    assert np.array_equal(images, first[1])


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
        return digest_of_frame(b"", (store.image(n, k) for n in range(LAYERS) for k in frames))

    rows = kept.groups([[0, 1], [2]], range(LAYERS), digest, make, lambda: None)
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


def test_a_damaged_group_is_made_anew(tmp_path: Path) -> None:
    _, images = grouped(tmp_path)
    (tmp_path / "kept" / STORE).write_bytes(b"")
    made, same = grouped(tmp_path)
    assert len(made) == 4
    assert np.array_equal(images, same)
