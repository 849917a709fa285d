"""The documents' pictures: made by their command, with its present options, from what lies in data/; small enough."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image

import docs.tools.pictures
from docs.tools.pictures import Picture, make, stale
from facefolds_core.errors import UserError

LARGEST = 1_000_000
"""Bytes of the moving picture: the README's first."""


def test_the_pictures_are_not_stale(project_root: Path) -> None:
    """Without data/actor, as in CI: by their options and their own bytes."""
    assert stale(project_root / "data" / "none") == []


def test_the_readme_fits_a_page_and_begins_with_a_small_film(project_root: Path) -> None:
    text = (project_root / "README.md").read_text(encoding="utf-8")
    first = project_root / re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)[0]
    with Image.open(first) as film:
        assert getattr(film, "n_frames", 1) > 10
    assert first.stat().st_size < LARGEST and len(text.splitlines()) <= 90


@pytest.fixture
def subject(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A subject with one picture, made."""

    def copy(folder: Path, out: Path) -> None:
        out.write_bytes((folder / "scores").read_bytes())

    monkeypatch.setattr(docs.tools.pictures, "PICTURES", {"a.jpg": Picture("scores", {"quality": 1}, copy)})
    (tmp_path / "scores").write_text("1")
    make("a.jpg", tmp_path, tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("edited", "said"), [("a.jpg", "changed since it was made"), ("scores", "made from another scores")]
)
def test_an_edited_picture_and_other_results_are_stale(subject: Path, edited: str, said: str) -> None:
    assert stale(subject, subject) == []  # just made
    (subject / edited).write_text("2")
    assert stale(subject, subject) == [f"a.jpg: {said}"]


def test_other_options_make_a_picture_stale(subject: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = docs.tools.pictures.PICTURES["a.jpg"]._replace(options={"quality": 2})
    monkeypatch.setattr(docs.tools.pictures, "PICTURES", {"a.jpg": picture})
    assert stale(subject, subject) == ["a.jpg: made with other options"]


def test_a_subject_without_results_is_said(subject: Path) -> None:
    (subject / "scores").unlink()
    with pytest.raises(UserError, match="nothing to make a picture from"):
        make("a.jpg", subject, subject)
