"""Large arrays lie in files, and are the same."""

from __future__ import annotations

import errno
import math
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from facefolds_core.captures.capture import Tracking
from facefolds_core.system import spill


def test_small_arrays_stay_in_memory_and_large_ones_do_not() -> None:
    small, large = spill.spilled((3, 4)), spill.spilled((spill.IN_MEMORY // 8 + 1,))
    assert small.base is None
    assert isinstance(large.base, np.memmap)
    large[-1] = 2.0
    assert large[-1] == 2.0


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where files lie."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


def test_nothing_is_left_behind(place: Path) -> None:
    with patch.object(spill, "IN_MEMORY", 0):
        array = spill.spilled((5, 5))
        array[:] = 1
    assert spill.spill_folder() == place and list(place.iterdir()) == []


def test_arrays_of_one_file_are_the_same(place: Path) -> None:
    random = np.random.default_rng(1)
    arrays = {"a": random.normal(size=(3, 5)), "none": np.zeros((0, 4), np.uint16), "b": np.arange(7, dtype=np.int32)}
    before = len(list(Path("/proc/self/fd").iterdir())) if Path("/proc/self/fd").exists() else 0
    found = spill.spilled_together(arrays, 0)
    assert found is not None and list(place.iterdir()) == []
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)
    if before:
        assert len(list(Path("/proc/self/fd").iterdir())) == before + 1  # one open file for all


def test_nothing_needs_no_room() -> None:
    found = spill.spilled_together({"none": np.zeros((0, 4))}, math.inf)
    assert found is not None and found["none"].shape == (0, 4)


@pytest.mark.parametrize("reserve", [0.0, math.inf])
def test_without_room_there_is_no_file(reserve: float) -> None:
    full = OSError(errno.ENOSPC, "no space")
    with patch("os.posix_fallocate", side_effect=full):
        assert spill.spilled_together({"a": np.zeros(4)}, reserve) is None


@pytest.mark.parametrize("frames", [None, [3, 0, 39]])
def test_meshes_are_the_same_in_parts(frames: list[int] | None) -> None:
    random = np.random.default_rng(0)
    tracking = Tracking(random.normal(size=(40, 3, 4)), random.normal(size=(40, 50, 3)), None)
    at_once = tracking.world_vertices(frames)
    with patch.object(spill, "IN_MEMORY", 0):
        in_parts = tracking.world_vertices(frames)
    assert isinstance(in_parts.base, np.memmap)
    assert np.array_equal(at_once, in_parts)
    moved = np.einsum("kij,kvj->kvi", tracking.poses[:, :, :3], tracking.vertices) + tracking.poses[:, None, :, 3]
    assert np.array_equal(at_once, moved if frames is None else moved[frames])


@pytest.mark.parametrize("count", [1, 2, 7, 40, 300])
def test_a_running_mean_is_the_mean(count: int) -> None:
    arrays = np.random.default_rng(count).normal(size=(count, 50, 3))
    assert np.array_equal(spill.running_mean(iter(arrays)), np.mean(list(arrays), 0))
