"""Scores of frames between frames: sums, which pixels move, which intervals are fast, the table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bench.between import METHODS, Sums, Truth, decibels, fast_intervals, measure, score, table
from facefolds_core.errors import UserError
from facefolds_core.export.between import between_rows
from facefolds_core.files import write_json
from facefolds_core.paths import SubjectFolders
from tests.assets import write_store


def sums(*intervals: tuple[float, float]) -> Sums:
    """Of intervals with so much error where it moves, and so large a share that does."""
    return np.array([(0.01 * 100, 100, moving, 100 * share) for moving, share in intervals])


def test_errors_count_where_the_subject_is_and_where_it_moves() -> None:
    pictures = np.full((3, 2, 2, 3), 100, np.uint8)
    pictures[1, 0, 0] = 151  # between the frames only
    pictures[2, 0, 1, 2] = 114  # a channel, by more than 0.05; (1, 1) by less
    pictures[2, 1, 1, 2] = 112
    opacity = np.full((3, 2, 2), 255, np.uint8)
    opacity[:, 1, 0] = 0
    black = np.zeros((2, 2, 3), np.float32)
    still, moving = (100 / 255) ** 2, (151 / 255) ** 2
    found = score(0, black, Truth(pictures, opacity), 1, 2)
    assert found == pytest.approx([moving + 2 * still, 3, moving + still, 2])


def test_decibels_are_over_all_pixels_together() -> None:
    found = sums((1.0, 0.1), (0.2, 0.02))
    assert decibels(found, moving=True) == pytest.approx(-10 * np.log10(1.2 / 12))
    assert decibels(found, moving=False) == pytest.approx(20)


def test_the_faster_half_of_the_intervals() -> None:
    found = sums(*((0.0, share) for share in (0.1, 0.4, 0.2, 0.3, 0.05)))
    assert np.flatnonzero(fast_intervals(found)).tolist() == [1, 3]


def test_the_table_has_a_row_a_method() -> None:
    rows = table(dict.fromkeys(METHODS, sums((0.01, 0.1), (0.02, 0.2)))).splitlines()[2:]
    assert [row.split("|")[1].strip() for row in rows] == list(METHODS)
    assert rows[0].split("|")[2:4] == [" 30.00 ", " 30.00 "]


@pytest.mark.parametrize("factor", [2, 3])
def test_every_method_gives_all_times_between(tmp_path: Path, factor: int) -> None:
    textures = np.random.default_rng(0).integers(0, 256, (3, 2, 32, 32, 4), dtype=np.uint8)
    store = write_store(tmp_path / "textures.arrow", textures)
    wanted = [k for k in range(2 * factor) if k % factor]
    found = {name: dict(method(store, factor)) for name, method in METHODS.items()}
    assert list(found.pop("frames")) == [0, factor, 2 * factor]
    assert all(list(frames) == wanted for frames in found.values())
    rows = {(layer, frame): image for layer, frame, image in between_rows(store, factor, progress=False)}
    for k in wanted:
        for layer in range(2):
            np.testing.assert_array_equal(found["ours"][k][layer], rows[layer, k])
            np.testing.assert_array_equal(found["repeat"][k][layer], textures[k // factor, layer])


def test_only_the_actor_has_a_truth(tmp_path: Path) -> None:
    folders = SubjectFolders(tmp_path)
    write_json(folders.config / "subject.json", {"source": "multiface", "path": "somewhere"})
    with pytest.raises(UserError, match="no truth between the frames"):
        measure(folders, 2)
