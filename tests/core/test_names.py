"""Names of subjects and places of captures, as every stage checks them, also when it is called by hand."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from facefolds_core.errors import UserError
from facefolds_core.files.paths import (
    SubjectFolders,
    check_path_text,
    check_place,
    check_subject_name,
    subject_folders,
    subject_of_dvc_stage,
)
from facefolds_core.files.writing import write_json
from facefolds_core.pipeline.capture import capture
from stages.common import run_stage
from stages.configure import configure
from tests.hostile.damage import fingerprint

SHELL = ["a;touch X;echo", "$(touch X)", "`touch X`", "'; touch X; '", '"; touch X; "', "a\ntouch X\n", "-x"]


BAD = [
    *SHELL,
    *("../../outside", "/etc", "a/../../precious", "", ".", "..", "../precious", "a/b", "/a", "a b", "a;b"),
    *("$(a)", "`a`", "a'b", "-a", "a\n", "\u00e9", "x" * 65),
]


@pytest.mark.parametrize("name", ["a", "_", "0", "Anna-2_b", "x" * 64])
def test_good_names(name: str) -> None:
    assert check_subject_name(name) == name


@pytest.mark.parametrize("name", [*BAD, 7, True, None, "a\0b"])
def test_bad_names(name: object) -> None:
    with pytest.raises(UserError, match="not a name"):
        check_subject_name(name)


@pytest.mark.parametrize("name", BAD)
def test_no_stage_works_outside_its_folder(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    precious = tmp_path / "precious" / "config" / "kept.txt"
    precious.parent.mkdir(parents=True)
    precious.write_text("kept")
    monkeypatch.setattr(sys, "argv", ["x", "--subject", name, "--data", str(tmp_path / "data")])
    monkeypatch.delenv("DVC_STAGE", raising=False)
    before = fingerprint(tmp_path)
    with pytest.raises(SystemExit) as caught:
        run_stage("x", lambda folders: pytest.fail(f"worked in {folders.root}"), "")
    assert caught.value.code == 1
    assert "remedy" in capsys.readouterr().err
    assert fingerprint(tmp_path) == before


def test_dvc_tells_the_subject() -> None:
    assert subject_of_dvc_stage("train", "train@anna") == "anna"
    assert subject_of_dvc_stage("train", "../dvc.yaml:train@anna") == "anna"


@pytest.mark.parametrize("told", ["", "train", "sample@anna", "train@", "train@a:train@b", "train@../x", "train@a@b"])
def test_what_dvc_never_tells(told: str) -> None:
    with pytest.raises(UserError):
        subject_of_dvc_stage("train", told)


@pytest.mark.parametrize("path", ["https://a/b", "s3://x", "remote://a", "", "  ", "-rf", "~/a", "a\nb", "a\0b"])
def test_paths_that_are_none(path: str) -> None:
    with pytest.raises(UserError, match=r"subjects\.anna\.path"):
        check_path_text(path, "anna", "params.yaml")


@pytest.mark.parametrize("path", ["../captures/x", "/data/x", "a b", "./-x", "C:x", "\u00e4"])
def test_paths(path: str) -> None:
    check_path_text(path, "anna", "params.yaml")


@pytest.mark.parametrize(
    "place", ["data/anna", "data/anna/capture", "data/anna/mine", "data", ".", "link", "elsewhere"]
)
def test_a_users_capture_is_never_replaced(place: str, tmp_path: Path) -> None:
    """Even where a link leads from one to the other, either way."""
    folders = subject_folders(tmp_path / "data", "anna")
    if place == "elsewhere":  # the stage's folder is a link to the capture
        (tmp_path / "elsewhere").mkdir()
        folders.root.mkdir(parents=True)
        folders.capture.symlink_to(tmp_path / "elsewhere")
    else:
        (folders.root / "mine").mkdir(parents=True)
        folders.capture.mkdir()
        (tmp_path / "link").symlink_to(folders.capture)
    (folders.capture / "KRT").write_text("precious")
    subject = {"source": "multiface", "path": str(tmp_path / place)}
    write_json(folders.config / "entry.json", subject)
    before = fingerprint(tmp_path)
    with pytest.raises(UserError, match="where the stages write"):
        capture(folders)
    assert fingerprint(tmp_path) == before


@pytest.mark.parametrize("place", ["data/anna/subject", "data/anna", "data", "link"])
def test_what_a_user_names_is_never_a_stage_s_own(place: str, tmp_path: Path) -> None:
    """DVC deletes the stage's folder before the stage reads it."""
    folders = subject_folders(tmp_path / "data", "anna")
    folders.subject.mkdir(parents=True)
    (tmp_path / "link").symlink_to(folders.subject)
    for key in ("mattes", "start"):
        with pytest.raises(UserError, match=rf"subjects\.anna\.{key}") as caught:
            check_place(str(tmp_path / place), folders, key)
        assert "where the stages write" in str(caught.value)
        for other in ("mine", "data/actor/subject"):
            assert check_place(str(tmp_path / other), folders, key) == tmp_path / other


@pytest.mark.parametrize("key", ["mattes", "start"])
def test_configure_looks_at_them(key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "params.yaml").write_text(f"subjects:\n  anna: {{source: actor, path: x, {key}: data/anna/subject}}\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=rf"subjects\.anna\.{key}"):
        configure(Path("data"))


def test_a_capture_of_another_subject_may_be_read(tmp_path: Path) -> None:
    folders = SubjectFolders(tmp_path / "data" / "anna")
    other = tmp_path / "data" / "actor" / "capture"
    assert check_place(str(other), folders, "path") == other


def test_a_link_to_itself_is_said(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(UserError, match="cannot be followed"):
        check_place(str(tmp_path / "loop" / "x"), SubjectFolders(tmp_path / "data" / "anna"), "path")
