"""UserError's message, whole-file writing, JSON reading."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import atomic_file, atomic_folder, read_json, write_json


def test_message_names_everything() -> None:
    error = UserError("bad", file="KRT", place="line 3", expected="3 numbers", found="2", remedy="mend it")
    text = str(error)
    for part in ("bad", "KRT", "line 3", "3 numbers", "2", "mend it"):
        assert part in text


def test_user_error_becomes_one_message_and_status_1(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop, report_user_errors("train"):
        raise UserError("bad", remedy="mend it")
    assert stop.value.code == 1
    printed = capsys.readouterr().err
    assert "train: error: bad" in printed
    assert "Traceback" not in printed


def test_a_failed_write_leaves_the_old_file_and_no_temporary(tmp_path: Path) -> None:
    target = tmp_path / "a.json"
    write_json(target, {"old": 1})
    with pytest.raises(RuntimeError), atomic_file(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert read_json(target) == {"old": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_a_failed_folder_leaves_the_old_folder(tmp_path: Path) -> None:
    target = tmp_path / "out"
    with atomic_folder(target) as temporary:
        (temporary / "x").write_text("1")
    with pytest.raises(RuntimeError), atomic_folder(target) as temporary:
        (temporary / "y").write_text("2")
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert [p.name for p in target.iterdir()] == ["x"]


def test_nan_is_never_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write_json(tmp_path / "a.json", {"psnr": float("nan")})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("content", "place"), [(b"{\n 1}", "line 2"), (b"", "line 1"), (b'{"a": "\xff"}', "byte 7")])
def test_garbled_json_names_the_place(tmp_path: Path, content: bytes, place: str) -> None:
    path = tmp_path / "transforms.json"
    path.write_bytes(content)
    with pytest.raises(UserError) as caught:
        read_json(path)
    assert place in str(caught.value)
    assert str(path) in str(caught.value)


def test_missing_json_is_a_user_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="file not found"):
        read_json(tmp_path / "none.json")


def test_json_round_trip(tmp_path: Path) -> None:
    value = {"a": [1, 2.5, None, "ä"]}
    write_json(tmp_path / "a.json", value)
    assert json.loads((tmp_path / "a.json").read_text()) == value
