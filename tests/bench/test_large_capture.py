"""The enlarged capture is a capture: the same cameras, each pixel where it was."""

from pathlib import Path

import numpy as np
import pytest

from bench.large_capture import enlarge, to_and_fro
from facefolds_core.captures.actor.capture import write_capture
from facefolds_core.captures.images import decode_image
from facefolds_core.captures.multiface import read_multiface
from facefolds_core.errors import UserError
from facefolds_core.params import CaptureParams, Subject


def test_a_film_is_played_to_and_fro() -> None:
    assert to_and_fro(8, 3) == [0, 1, 2, 1, 0, 1, 2, 1]
    assert to_and_fro(3, 1) == [0, 0, 0]
    assert to_and_fro(3, 2) == [0, 1, 0]


def test_enlarged_cameras_see_the_same_points(tmp_path: Path) -> None:
    write_capture(tmp_path / "small", CaptureParams(cameras=3, frames=2, height=24, width=16))
    enlarge(tmp_path / "small", tmp_path / "large", 3, 4)
    small, large = (
        read_multiface(tmp_path / name, Subject(source="multiface", path="")) for name in ("small", "large")
    )
    assert [len(capture.frame_ids) for capture in (small, large)] == [2, 4]
    for a, b in zip((v.camera for v in small.views), (v.camera for v in large.views), strict=True):
        assert (b.width, b.height) == (3 * a.width, 3 * a.height)
        np.testing.assert_allclose(b.K[:2], 3 * a.K[:2], atol=1e-6)
        np.testing.assert_array_equal(a.w2c, b.w2c)
    picture = Path("images/PERFORMANCE/A000/000001.png")
    before, after = (decode_image(tmp_path / name / picture, "") for name in ("small", "large"))
    means = after.reshape(24, 3, 16, 3, 3).mean((1, 3))
    assert np.abs(means - before).mean() < 8  # cubic, of a textured picture
    assert (tmp_path / "large" / picture).samefile(tmp_path / "large" / "images/PERFORMANCE/A000/000003.png")


def test_what_is_no_capture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no capture of the embedded actor"):
        enlarge(tmp_path, tmp_path / "large", 2, 2)
