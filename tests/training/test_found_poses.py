"""Poses found in the pictures, whole: of the filmed actor, who turns, against those that she was filmed with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import facefolds_core as facefolds
from facefolds_core.captures.actor import write_capture
from facefolds_core.geometry.track import Track
from facefolds_core.params import CaptureParams, SubjectParams
from facefolds_core.training import registration

pytestmark = pytest.mark.slow

FILM = CaptureParams(cameras=8, frames=2, height=96, width=64, plates=False, head_motion=8.0)


def poses(film: Path, folder: Path, stabilize: bool | str) -> Track:
    capture = facefolds.load_capture(film, folder=folder, name="actor", holdout=["A004"], fps=FILM.frame_rate)
    found = facefolds.normalize(capture, stabilize=stabilize).poses
    assert found is not None
    return found


def test_poses_are_found_in_the_pictures_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By fewer Gaussians than usual: the pictures are small."""
    monkeypatch.setattr(registration, "DEFAULT_SUBJECT", SubjectParams(iterations=500, fewest=3000))
    write_capture(tmp_path / "film", FILM)
    true, found = (poses(tmp_path / "film", tmp_path / str(how), how) for how in (True, "found"))
    # From frame to frame: the frames that the two call the head's own may differ.
    moves = [track.at(1).after(track.at(0).inverse()) for track in (true, found)]
    turns = [Track.of([move.rotation], [np.zeros(3)]).degrees()[0] for move in moves]
    off = Track.of([moves[0].inverse().after(moves[1]).rotation], [np.zeros(3)]).degrees()[0]
    assert min(turns) > 6 and off < 1
