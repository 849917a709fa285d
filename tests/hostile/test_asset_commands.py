"""The commands on assets, given what cannot be: words and exit status 1, no traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from facefolds_core.cli import app
from facefolds_core.cli.render import LIMITS
from tests.assets import make_asset


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("commands") / "asset"
    make_asset(folder, layers=1, frames=1, resolution=32)
    return folder


def refused(*words: str | Path) -> str:
    """Run `facefolds WORDS`; what it says, having failed in words."""
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code in (1, 2), result.output
    assert result.exception is None or isinstance(result.exception, SystemExit), repr(result.exception)
    return result.output


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e300"])
@pytest.mark.parametrize("option", LIMITS)
def test_numbers_that_are_none(asset: Path, tmp_path: Path, option: str, value: str) -> None:
    said = refused("render", asset, "--out", tmp_path / "a.png", f"--{option}={value}")
    assert option in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("size", ["9" * 5000 + "x16", "99999x99999", "9000x16", "-1x16", "16x", "\u0661\u0666x16"])
def test_sizes_that_cannot_be(asset: Path, tmp_path: Path, size: str) -> None:
    assert "--size" in refused("render", asset, "--out", tmp_path / "a.png", "--size", size)


@pytest.mark.parametrize("name", ["x" * 5000, "/dev/null", "nowhere", "a\nb"])
@pytest.mark.parametrize("command", ["validate", "render", "export godot", "export glb", "view"])
def test_folders_that_are_none(tmp_path: Path, command: str, name: str) -> None:
    more = {command: [tmp_path / "out"] for command in ("export godot", "export glb")}
    more |= {"render": ["--out", tmp_path / "a.png"], "view": ["--no-browser"]}
    assert "no such folder" in refused(*command.split(), name, *more.get(command, []))


def test_an_exporter_that_is_none(asset: Path, tmp_path: Path) -> None:
    assert "glb, gltf, godot" in refused("export", "unreal", asset, tmp_path / "out")


def test_a_file_in_place_of_the_folder_to_write(asset: Path, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    assert "a file stands" in refused("export", "godot", asset, tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"


def test_a_manifest_that_steers_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text('{"format": "facefolds", "version": "\\u001b[31m\\u0007"}')
    assert "\x1b" not in refused("validate", tmp_path) and "\x1b" not in refused("view", tmp_path)
