"""Captures well formed and wrong all the same: meshes beyond sense, odd texts, no files in files' places."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from facefolds_core.captures.capture import frame_rate
from facefolds_core.captures.sound import cut_sound
from facefolds_core.config.params_file import Params, write_configs
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.params import Subject
from facefolds_core.pipeline.capture import capture
from facefolds_core.pipeline.normalize import normalize
from tests.captures.fixtures import RING, SEGMENT, edit_transforms, save_wav, write_multiface, write_transforms
from tests.captures.test_bad_captures import refused, run
from tests.hostile.structured import ODD
from tests.hostile.watch import within


def test_a_byte_order_mark_hides_no_camera(tmp_path: Path) -> None:
    made = write_multiface(tmp_path / "c")
    for path in (made.krt, tmp_path / "c" / "frame_list.txt", made.mesh("000003", "_transform.txt")):
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    folders = run(tmp_path / "c", "multiface")
    scene = json.loads((folders.scene / "scene.json").read_text())
    assert [camera["name"] for camera in scene["cameras"]] == [name for name, _, _ in RING]
    assert not [one for one in scene["left_out"] if not one["words"].startswith("note")]


FILES = {
    "multiface": [
        "KRT",
        "frame_list.txt",
        f"images/{SEGMENT}/400001/000003.png",
        f"images/{SEGMENT}/400004/000009.png",
        f"masks/{SEGMENT}/400003/000003.png",
        f"tracked_mesh/{SEGMENT}/000003.obj",
        f"tracked_mesh/{SEGMENT}/000006.bin",
        f"tracked_mesh/{SEGMENT}/000009_transform.txt",
        f"audio/{SEGMENT}.wav",
    ],
    "transforms": ["transforms.json", "images/400002.png"],
}


@pytest.mark.parametrize("odd", [name for name in ODD if name != "nothing"])
@pytest.mark.parametrize(("source", "name"), [(s, n) for s, names in FILES.items() for n in names])
def test_what_is_no_file_is_refused_and_never_opened(tmp_path: Path, source: str, name: str, odd: str) -> None:
    write_multiface(tmp_path / "c") if source == "multiface" else write_transforms(tmp_path / "c")
    path = tmp_path / "c" / name
    path.unlink(missing_ok=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    ODD[odd](path)
    errors: list[UserError] = []
    within(10, lambda: errors.append(refused(tmp_path / "c", source, front="400003")))()
    assert errors[0].file == path


@pytest.mark.parametrize("label", ["x" * 300 + ".png", "a\0b.png", "x/" * 3000 + "y.png"])
def test_names_that_cannot_be_are_missing_images(tmp_path: Path, label: str) -> None:
    path, _ = write_transforms(tmp_path / "c")
    edit_transforms(path, 1, file_path=label)
    folders = run(tmp_path / "c", "transforms", front="400003")
    left_out = json.loads((folders.scene / "scene.json").read_text())["left_out"]
    assert any("no image" in one["words"] for one in left_out)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("fps", value) for value in (1e-300, 1e300, 1e-3, math.nan, math.inf)),
        *(("krt_size", value) for value in ((0, 0), (-40, 64), (10**12, 3))),
    ],
)
def test_a_rate_or_size_that_none_can_have(key: str, value: object) -> None:
    with pytest.raises(ValidationError, match=key):
        Subject.model_validate({"source": "multiface", "path": "x", key: value})


def test_usual_rates_are_fine() -> None:
    subject = Subject(source="actor", path="x", fps=240)
    assert [frame_rate(subject, 30, count) for count in (1, 2)] == [0, 240]


@pytest.mark.parametrize(
    "path", ["https://example.org/capture", "x" * 300, "a\0b", "x" * 300 + ".json", "x/" * 3000], ids=lambda x: x[:9]
)
@pytest.mark.parametrize("source", ["multiface", "transforms"])
def test_a_path_that_cannot_be(tmp_path: Path, source: str, path: str) -> None:
    """An address of the net must be downloaded first."""
    subject = Subject(source=source, path=path)
    folders = SubjectFolders(tmp_path / "data" / "head")
    write_configs(Params(subjects={"head": subject}, sections={}, path="params.yaml"), "head", folders.config)
    for stage in (capture, normalize):
        with pytest.raises(UserError, match="not a path" if "://" in path else None) as caught:
            stage(folders)
        assert caught.value.remedy
        assert "://" not in path or caught.value.place == "subjects.head.path"


@pytest.mark.parametrize("kind", ["shorter than it says", "a playlist"])
def test_what_is_no_sound(tmp_path: Path, kind: str) -> None:
    """A playlist's other files are not opened."""
    path = tmp_path / "x.wav"
    save_wav(path, np.zeros(4000), 8000)
    whole = path.rename(tmp_path / "other.wav").read_bytes()
    playlist = ["#EXTM3U", "#EXT-X-TARGETDURATION:1", "#EXTINF:1,", f"{tmp_path}/other.wav", "#EXT-X-ENDLIST"]
    path.write_bytes(whole[:5000] if kind == "shorter than it says" else "\n".join(playlist).encode())
    with pytest.raises(UserError, match="sound cannot be read"):
        cut_sound(path, tmp_path / "cut.wav", 0, 0.1)
