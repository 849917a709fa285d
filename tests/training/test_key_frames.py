"""The choice of key frames, and what each frame is made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.training.likeness import comparable, farthest_first, likenesses
from facefolds_core.training.segments import plan
from facefolds_core.training.segments.plan import mixture
from tests.scenes import make_scene

LINE = np.array([[0.0], [1.0], [2.0], [3.0], [10.0]], np.float32)


def test_the_middle_comes_first_then_always_the_farthest() -> None:
    rows = comparable([LINE])
    assert farthest_first(rows, 1) == [3]
    assert farthest_first(rows, 2) == [3, 4]
    assert farthest_first(rows, 3) == [0, 3, 4]
    assert farthest_first(rows, 99) == [0, 1, 2, 3, 4]
    assert farthest_first(rows, 3, first=1) == [1, 3, 4]


@pytest.mark.parametrize("blend", [0.0, 0.5])
def test_shares_change_without_a_leap(blend: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Along a line past six key frames, three of which make up a frame."""
    keys = np.arange(6, dtype=np.float32)[:, None] * np.float32(1.3)
    monkeypatch.setattr(plan, "BLEND", blend)
    path = [mixture(np.array([x], np.float32), keys) for x in np.linspace(0, 6, 3001)]
    assert np.allclose([shares.sum() for shares in path], 1)
    assert max(np.count_nonzero(shares) for shares in path) <= 3
    assert np.abs(np.diff(path, axis=0)).max() < 0.02


def test_a_key_frame_is_itself_or_blended_with_its_neighbours(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = LINE[:4]
    blended = mixture(rows[1], rows)
    assert blended.argmax() == 1 and 0.4 < blended[1] < 0.95
    monkeypatch.setattr(plan, "BLEND", 0.0)
    assert mixture(rows[1], rows).tolist() == [0, 1, 0, 0]


def test_frames_that_look_alike_are_near_one_another(tmp_path: Path) -> None:
    scene = make_scene(tmp_path / "scene", size=32, frames=4)
    rows = comparable(likenesses(scene))
    distance = [float(np.square(rows[k] - rows[0]).sum()) for k in range(4)]
    assert distance == sorted(distance) and distance[3] > 2 * distance[1] > 0
