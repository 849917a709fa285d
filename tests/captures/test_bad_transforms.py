"""Bad transforms.json: each gives one message that names file, place and remedy, and leaves nothing behind."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.captures.fixtures import edit_transforms, write_transforms
from tests.captures.test_bad_captures import Edit, refused

HUGE = [[1, 0, 0, 10**18], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
LAST_ROW = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 0, 7]]
ENTRIES: dict[str, tuple[Edit, str, str]] = {
    "no path": ({"file_path": None}, "a key is missing", "frames[1], file_path"),
    "a list for a path": ({"file_path": ["images/400002.png"]}, "a key is missing", "frames[1], file_path"),
    "no matrix": ({"transform_matrix": None}, "a key is missing", "transform_matrix"),
    "3 x 3": ({"transform_matrix": np.eye(3).tolist()}, "wrong shape", "transform_matrix"),
    "ragged": ({"transform_matrix": [[1, 0], [0]]}, "wrong shape", "transform_matrix"),
    "words": ({"transform_matrix": "identity"}, "wrong shape", "transform_matrix"),
    "singular": ({"transform_matrix": np.diag([1, 1, 0, 1]).tolist()}, "no rotation", "transform_matrix"),
    "nan": ({"transform_matrix": (np.eye(4) * np.nan).tolist()}, "not a number", "transform_matrix"),
    "a string in it": ({"transform_matrix": [["1", 0, 0, 0], *HUGE[1:]]}, "not a number", "transform_matrix"),
    "true in it": ({"transform_matrix": [[True, 0, 0, 0], *HUGE[1:]]}, "not a number", "transform_matrix"),
    "huge in it": ({"transform_matrix": HUGE}, "not a number", "transform_matrix"),
    "last row": ({"transform_matrix": LAST_ROW}, "last row", "transform_matrix"),
    "no focal length": ({"fl_x": None, "fl_y": None}, "no focal length", "frames[1]"),
    "focal length 0": ({"fl_x": 0}, "singular", "frames[1]"),
    "focal word": ({"fl_x": "long"}, "not a number", "fl_x"),
    "focal string": ({"fl_x": "150.0"}, "not a number", "fl_x"),
    "object": ({"fl_y": {}}, "not a number", "fl_y"),
    "true": ({"cx": True}, "not a number", "cx"),
    "huge integer": ({"cy": 10**18}, "not a number", "cy"),
    "list": ({"k1": [0.1]}, "not a number", "k1"),
    "other size": ({"w": 400}, "another size", "frames[1] (images/400002.png), w"),
    "camera model": ({"camera_model": "FOV"}, "camera model", "frames[1]"),
    "list of models": ({"camera_model": ["OPENCV"]}, "camera model", "frames[1]"),
    "word for true": ({"is_fisheye": "false"}, "neither true nor false", "is_fisheye"),
    "strong fisheye": ({"camera_model": "OPENCV_FISHEYE", "k1": -90.0}, "distortion is too strong", "frames[1]"),
    "strong distortion": ({"k1": 90.0}, "distortion is too strong", "frames[1]"),
    "one time each": ({"time": 3.0}, "one time only", "time"),
    "no angle of view": ({"fl_x": None, "fl_y": None, "camera_angle_x": 0}, "no angle of view", "frames[1]"),
    "negative angle": ({"fl_x": None, "fl_y": None, "camera_angle_x": -0.5}, "no angle of view", "frames[1]"),
    "angle of a turn": ({"fl_x": None, "fl_y": None, "camera_angle_x": 4}, "no angle of view", "frames[1]"),
}


@pytest.mark.parametrize(("edit", "message", "place"), ENTRIES.values(), ids=ENTRIES)
def test_bad_entry_of_transforms(tmp_path: Path, edit: Edit, message: str, place: str) -> None:
    path, _ = write_transforms(tmp_path / "c")
    edit_transforms(path, 1, **edit)
    error = refused(tmp_path / "c", "transforms", front="400003")
    assert (message in error.message, error.file, place in str(error.place)) == (True, path, True)


def test_choices_that_it_does_not_allow(tmp_path: Path) -> None:
    write_transforms(tmp_path / "c")
    error = refused(tmp_path / "c", "transforms", front="36")
    assert (error.place, error.found) == ("front", "36")
    error = refused(tmp_path / "c", "transforms", {"normalize": {"stabilize": True}}, front="400003")
    assert "stabilize" in str(error.remedy)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        *((text, "") for text in ("", "[]", '{"frames": []}', '{"frames": [3]}', '{"frames": {"a": 1}}')),
        ('{"frames": [{', "line 1"),
        ('{\n "frames": [\n  1,\n  2', "line 4"),
    ],
)
def test_garbled_transforms(tmp_path: Path, text: str, place: str) -> None:
    path, _ = write_transforms(tmp_path / "c")
    path.write_text(text)
    error = refused(tmp_path / "c", "transforms")
    assert error.file == path and str(error.place or "").startswith(place)


def test_no_transforms_and_no_image_of_them(tmp_path: Path) -> None:
    path, _ = write_transforms(tmp_path / "c")
    shutil.rmtree(tmp_path / "c" / "images")
    assert "none of the images" in refused(tmp_path / "c", "transforms").message
    path.unlink()
    error = refused(tmp_path / "c", "transforms")
    assert error.file == tmp_path / "c" and "transforms.json" in str(error.expected)
