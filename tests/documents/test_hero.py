"""The hero: its parameters, its project, and what is packed."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from bench.results import commit_name
from docs.tools import hero
from facefolds_core.asset import read_asset
from facefolds_core.config.params_file import load_params
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_json
from facefolds_core.params import CaptureParams
from tests.assets import make_asset


def test_the_whole_take_is_25_frames_a_second() -> None:
    params = hero.hero_params({})
    capture = CaptureParams.model_validate(params["subjects"]["hero"]["capture"])
    assert (capture.frames, capture.seconds, capture.frame_rate) == (100, 4.0, 25.0)
    assert (capture.width, capture.height) == (500, 768)
    for name in ("decimate", "texture"):  # R^m and R^t: numbers would be of pictures of 192 x 128
        sections = {**params.get(name, {}), **params["subjects"]["hero"].get(name, {})}
        assert sections.get("resolution", "auto") == "auto"


def test_a_project_of_its_own_that_keeps_what_it_made(tmp_path: Path) -> None:
    for frames in (100, 12):
        hero.write_project(tmp_path, hero.hero_params({"frames": frames}))
        (tmp_path / "data").mkdir(exist_ok=True)
    params = load_params(tmp_path / "params.yaml")
    assert list(params.subjects) == ["hero"]
    assert (tmp_path / "facefolds_core" / "params").is_dir() and (tmp_path / "data").is_dir()


def test_what_is_packed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = SubjectFolders(tmp_path / "hero")
    make_asset(folders.asset)
    write_json(folders.metrics, {"headline": "psnr_subject", "asset": {"psnr_subject": 26.5}})
    monkeypatch.setattr(hero, "find_player", lambda: tmp_path)
    monkeypatch.setattr(hero, "write_single_page", lambda out, _, __, level, ___: out.write_text(level.name))
    monkeypatch.setattr(hero, "embedded", lambda asset: asset.manifest.full.model_copy(update={"name": "medium"}))
    page, packed = hero.release(folders, tmp_path / "out")
    assert page.read_text() == "medium"  # the full level may be too large for a page
    with zipfile.ZipFile(packed) as zipped:
        zipped.extractall(tmp_path / "there")
        assert "26.50 dB of the subject" in zipped.read("README.txt").decode()
    assert read_asset(tmp_path / "there" / "asset").num_frames == read_asset(folders.asset).num_frames
    assert (tmp_path / "there" / "hero.html").read_text() == page.read_text()
    assert (tmp_path / "out" / "commit.txt").read_text() == commit_name()
    assert {"LICENSE", "metrics.json"} <= {path.name for path in (tmp_path / "there").iterdir()}
