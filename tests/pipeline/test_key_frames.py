"""The stage `sample` knows the key frames of a take in segments by their names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from facefolds_core.errors import UserError
from facefolds_core.files.writing import write_json
from facefolds_core.pipeline.sample import _key_frames
from tests.scoring.fakes import flat_scene


def test_key_frames_are_found_by_name(tmp_path: Path) -> None:
    scene = replace(flat_scene(tmp_path), frame_ids=("a", "b", "c"))
    fit = tmp_path / "fit.json"
    assert _key_frames(fit, scene) is None  # of perceptrons
    write_json(fit, {"events": []})
    assert _key_frames(fit, scene) is None  # trained at once
    write_json(fit, {"key_frames": ["c", "a"]})
    assert _key_frames(fit, scene) == [2, 0]
    write_json(fit, {"key_frames": ["c", "x"]})
    with pytest.raises(UserError, match=r"do not belong together[\s\S]*x"):
        _key_frames(fit, scene)
