"""Which segment of a capture is meant, and which of its cameras can be used."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from facefolds_core.captures.gathering import cameras_with_pictures, chosen_segment
from facefolds_core.errors import UserError

PLACE = Path("images")


@dataclass(frozen=True)
class Camera:
    name: str


@pytest.mark.parametrize(("names", "wanted"), [(["a", "b"], "b"), (["b"], None), (["b"], "b")])
def test_the_segment_that_is_named_or_the_only_one(names: list[str], wanted: str | None) -> None:
    assert chosen_segment(names, wanted, PLACE, "") == "b"


@pytest.mark.parametrize(
    ("names", "wanted", "words", "remedy"),
    [
        ([], None, "no takes", "film some"),
        ([], "a", "no takes", "film some"),
        (["b", "a"], None, "several takes, and none is chosen", "set `segment`"),
        (["b", "a"], "c", "no such take", "correct `segment`"),
    ],
)
def test_what_cannot_be_chosen(names: list[str], wanted: str | None, words: str, remedy: str) -> None:
    with pytest.raises(UserError) as caught:
        chosen_segment(names, wanted, PLACE, "film some", "take")
    error = caught.value
    assert (error.message, error.file, error.found) == (words, PLACE, wanted)
    assert remedy in str(error.remedy) and (not names or error.expected == "one of a, b")


def test_cameras_without_pictures_and_pictures_without_calibration_are_said() -> None:
    """An empty folder of a camera that nobody calibrated is nothing."""
    cameras = [Camera("a"), Camera("b"), Camera("c")]
    used, facts = cameras_with_pictures(cameras, {"a": {"0": 1}, "b": {}, "x": {"0": 1}, "y": {}}, PLACE)
    kinds = [(one.kind, one.camera) for one in facts]
    assert (used, kinds) == ([cameras[0]], [("no_images", "b"), ("no_images", "c"), ("uncalibrated", "x")])


def test_no_camera_with_both_is_refused() -> None:
    with pytest.raises(UserError, match="both pictures and a calibration") as caught:
        cameras_with_pictures([Camera("a")], {"b": {"0": 1}}, PLACE)
    assert "a" in str(caught.value.expected) and caught.value.found == "b"
