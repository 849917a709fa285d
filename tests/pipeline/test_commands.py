"""Every command of `facefolds` on what a real run of the pipeline left, from `configure` by DVC to the scores."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from types import SimpleNamespace

import av
import pytest
from PIL import Image
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.cli import COMMANDS, app, view
from tests.pipeline.tiny import TinyProject

ASSET = "data/actor/asset"


@pytest.fixture(autouse=True)
def there(project: TinyProject, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands are given in the project's folder."""
    monkeypatch.chdir(project.root)


def facefolds(*words: str | Path) -> str:
    """What `facefolds WORDS` prints, having succeeded."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


ELSEWHERE = ["export-html", "run"]


def test_all_commands_are_here() -> None:
    """A new command needs a line here; some have tests elsewhere: tests/packaging, tests/viewer, ..."""
    text = Path(__file__).read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f'facefolds("{name}"' not in text] == ELSEWHERE


def test_validate() -> None:
    assert "sound" in facefolds("validate", ASSET)


@pytest.mark.parametrize("level", ["full", "small"])
def test_render_a_still(level: str, tmp_path: Path) -> None:
    facefolds("render", ASSET, "--out", tmp_path / "a.png", "--size", "64x48", "--level", level)
    with Image.open(tmp_path / "a.png") as picture:
        low, high = picture.convert("L").getextrema()
        assert picture.size == (64, 48) and high - low > 40


def test_render_a_film(tmp_path: Path) -> None:
    facefolds(
        "render", ASSET, "--kind", "turntable", "--seconds", "0.2", "--out", tmp_path / "a.mp4", "--size", "64x48"
    )
    with av.open(str(tmp_path / "a.mp4")) as film:
        assert len(list(film.decode(video=0))) == 6


def test_export(tmp_path: Path) -> None:
    facefolds("export", "glb", ASSET, tmp_path / "a.glb")
    assert (tmp_path / "a.glb").read_bytes()[:4] == b"glTF"
    facefolds("export", "godot", ASSET, tmp_path / "godot", "--level", "small")
    small = read_asset(ASSET).manifest.levels[0]
    assert small.name == "small" and len(list((tmp_path / "godot").glob("layer_*.mesh"))) == len(small.layers) > 0


def test_report(project: TinyProject) -> None:
    """It reads every file of the configuration, whatever `configure` writes."""
    written = sorted(path.stem for path in (project.root / "data" / ".config" / "actor").iterdir())
    assert "levels" in written
    facefolds("report", "data/actor")
    page = (project.root / "data" / "actor" / "report.html").read_text(encoding="utf-8")
    assert [name for name in written if f">{name}<" not in page] == []
    scores = json.loads((project.root / "data" / "actor" / "metrics.json").read_text())
    assert f"{scores['asset']['psnr_subject']:.2f}" in page


def test_scores(project: TinyProject) -> None:
    scores = json.loads((project.root / "data" / "actor" / "metrics.json").read_text())
    said = facefolds("scores")
    assert f"{scores['asset']['psnr_subject']:.2f}" in said and "data/actor/asset" in said


def test_view(project: TinyProject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ended at once."""

    class Interrupted(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            raise KeyboardInterrupt

    (tmp_path / "index.html").write_text("the player")
    monkeypatch.setattr(view, "find_player", lambda: tmp_path)
    monkeypatch.setattr(view, "threading", SimpleNamespace(Event=Interrupted))  # others need the real one
    said = facefolds("view", ASSET, "--no-browser")
    assert str((project.root / ASSET).resolve()) in said and "view: ended" in said


def test_doctor() -> None:
    assert "doctor: " in facefolds("doctor")
