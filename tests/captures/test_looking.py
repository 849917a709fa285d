"""What any folder is: for `facefolds doctor PATH`, and for who names a wrong source."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from facefolds_core.captures.appraisal import _quoted, appraise
from facefolds_core.captures.looking import describe, look
from facefolds_core.captures.sources import read_capture
from facefolds_core.cli import app
from facefolds_core.errors import UserError
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.params import CaptureParams, Subject
from facefolds_core.registry import SOURCES
from tests.captures.fixtures import pattern, save, write_multiface, write_transforms


def entry_of(lines: list[str]) -> dict[str, object]:
    """The subject of the YAML that was printed."""
    text = "\n".join(lines[lines.index("subjects:") :])
    (subject,) = yaml.safe_load(text)["subjects"].values()
    return dict(subject)


def test_a_multiface_capture_is_told_with_what_it_has_and_lacks(tmp_path: Path) -> None:
    write_multiface(tmp_path / "0042 anna")
    (tmp_path / "0042 anna" / "images" / "E001_Neutral" / "400001" / "000003.png").unlink()
    lines = list(appraise(tmp_path / "0042 anna"))
    text = "\n".join(lines)
    assert "a Multiface subject" in lines[0]
    assert "would be used: 5 of 5 cameras, 3 frames at 30 a second, 40 x 64 pixels" in text
    assert "it has a tracked mesh" in text
    assert "frame 000003: no image from 400001" in text
    assert "  0042-anna:" in lines
    entry = entry_of(lines)
    assert (entry["source"], entry["path"]) == ("multiface", str(tmp_path / "0042 anna"))
    assert entry["holdout"] in (["400002"], ["400004"])


def test_the_yaml_that_is_printed_is_read(tmp_path: Path) -> None:
    write_transforms(tmp_path / "statue")
    entry = entry_of(list(appraise(tmp_path / "statue")))
    assert entry["front"] == "400003"
    assert _quoted("0018") == "'0018'"  # plain, a number of YAML 1.2
    subject = Subject.model_validate(entry)
    assert read_capture(subject, SubjectFolders(tmp_path / "data" / "x"), CaptureParams()).views


def test_a_camera_that_has_masks_is_held_out(tmp_path: Path) -> None:
    capture = write_multiface(tmp_path / "c")
    for frame in capture.frames:
        save(tmp_path / "c" / "masks" / "E001_Neutral" / "400004" / f"{frame}.png", pattern(40, 64, 0)[..., 0])
    assert entry_of(list(appraise(tmp_path / "c")))["holdout"] == ["400004"]


def test_what_cannot_be_used_says_why(tmp_path: Path) -> None:
    capture = write_multiface(tmp_path / "c")
    capture.krt.write_text("400001\n1 2 3\n")
    text = "\n".join(appraise(tmp_path / "c"))
    assert "it cannot be used as it is:" in text and "KRT" in text


def picture(root: Path, name: str) -> None:
    save(root / name, pattern(8, 8, 0))


UNKNOWN = [
    ("pictures", lambda r: picture(r, "a/0.jpg"), "1 pictures without a calibration", "COLMAP"),
    ("films", lambda r: (r / "cam1.mp4").touch(), "1 films without a calibration", "COLMAP"),
    ("zju", lambda r: (r / "annots.npy").touch(), "a pickle", "easymocap"),
    ("unfinished colmap", lambda r: (r / "database.db").touch(), "without a model", "colmap mapper"),
    ("llff", lambda r: ((r / "poses_bounds.npy").touch(), picture(r, "images/0.jpg")), "LLFF", "colmap"),
    ("metashape", lambda r: (r / "x.psx").touch(), "Metashape", "export"),
    ("archive", lambda r: (r / "x.zip").touch(), "packed", "unpack"),
    ("nothing", lambda r: None, "an empty folder", "path"),
    ("texts", lambda r: (r / "x.md").touch(), "files of no capture (1 .md)", "transforms.json of nerfstudio"),
    ("parent", lambda r: write_transforms(r / "inner"), "holds captures: inner (transforms)", "one of them"),
]


@pytest.mark.parametrize(("make", "what", "remedy"), [row[1:] for row in UNKNOWN], ids=[row[0] for row in UNKNOWN])
def test_a_folder_of_no_known_layout_is_described(tmp_path: Path, make: object, what: str, remedy: str) -> None:
    make(tmp_path)  # type: ignore[operator]
    assert look(tmp_path) == []
    said = describe(tmp_path)
    assert what in said[0] and remedy in said[1]


MARKS = {
    "actorshq": ["calibration.csv", "rgbs/Cam001/Cam001_rgb000000.jpg"],
    "ava256": ["camera_calibration.json", "frame_list.csv", "image/cam401031.zip"],
    "colmap": ["sparse/0/cameras.bin", "sparse/0/images.bin", "sparse/0/points3D.bin", "images/a.jpg"],
    "easymocap": ["intri.yml", "extri.yml", "images/1/000000.jpg"],
    "multiface": ["KRT", "frame_list.txt", "images/S/400001/000001.png", "tracked_mesh/S/000001.bin"],
    "nersemble": ["calibration/camera_params.json", "sequences/S/images/cam_1.mp4"],
    "neural3d": ["poses_bounds.npy", "cam00.mp4", "cam01.mp4"],
    "renderme": ["0026_e0_raw.smc", "0026_e0_anno.smc"],
    "transforms": ["transforms.json", "images/a.png"],
}
"""What a layout has on disk: names are enough to tell it."""


def test_every_layout_has_its_marks() -> None:
    assert sorted(MARKS) == [name for name in SOURCES.names if name != "actor"]


@pytest.mark.parametrize("source", MARKS)
def test_a_layout_is_recognised_by_its_own_source_and_no_other(tmp_path: Path, source: str) -> None:
    for name in MARKS[source]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert [(name, said.path) for name, said in look(tmp_path)] == [(source, tmp_path)]


def test_a_part_of_a_capture_leads_to_the_whole(tmp_path: Path) -> None:
    write_transforms(tmp_path / "c")
    said = describe(tmp_path / "c" / "images")
    assert said[0] == "a part of a capture of nerfstudio or instant-ngp"
    assert str(tmp_path / "c") in said[1]


def refused(tmp_path: Path, source: str, path: Path, remedy: str) -> UserError:
    """The error that such a subject's capture gives, whose remedy has these words."""
    with pytest.raises(UserError) as caught:
        read_capture(Subject(source=source, path=str(path)), SubjectFolders(tmp_path / "data" / "x"), CaptureParams())
    assert remedy in str(caught.value.remedy)
    return caught.value


def test_a_wrong_source_is_told_from_the_right_one(tmp_path: Path) -> None:
    write_transforms(tmp_path / "c")
    error = refused(tmp_path, "colmap", tmp_path / "c", "set `source: transforms`")
    assert "not a capture of source colmap" in error.message and "(source: transforms)" in str(error.found)


def test_a_place_above_what_is_meant_is_corrected(tmp_path: Path) -> None:
    inner = tmp_path / "Sequence1" / "4x"
    inner.mkdir(parents=True)
    (inner / "calibration.csv").touch()
    refused(tmp_path, "actorshq", inner.parent, f"set `path: {inner}`")


def test_the_command_prints_it_and_refuses_what_is_not_there(tmp_path: Path) -> None:
    write_multiface(tmp_path / "c")
    done, failed = (CliRunner().invoke(app, ["doctor", str(tmp_path / name)]) for name in ("c", "nowhere"))
    assert (done.exit_code, failed.exit_code) == (0, 1) and "source: multiface" in done.output
