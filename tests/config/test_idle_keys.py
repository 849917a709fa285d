"""Values of a section that no subject uses are named."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.config.params_file import idle_keys, load_params


def lines(folder: Path, text: str) -> list[str]:
    (folder / "params.yaml").write_text(text)
    return idle_keys(load_params(folder / "params.yaml"))


def test_the_projects_own_file_has_none(project_root: Path) -> None:
    assert idle_keys(load_params(project_root / "params.yaml")) == []


def test_a_key_that_one_subject_uses_is_not_idle(tmp_path: Path) -> None:
    text = "subjects:\n  a: {source: actor, path: x, texture: {resolution: 8}}\n  b: {source: actor, path: x%s}\n"
    text += "texture: {resolution: 16}\n"
    assert lines(tmp_path, text % "") == []
    assert len(lines(tmp_path, text % ", texture: {resolution: 32}")) == 1


def test_deeper_keys(tmp_path: Path) -> None:
    text = "subjects:\n  a: {source: actor, path: x, compress: {video: {crf: 9}}}\n"
    text += "compress: {video: {crf: 20, preset: slow}, levels: []}\n"
    assert [line.split(":")[0] for line in lines(tmp_path, text)] == ["compress.video.crf"]
