"""The films of hidden cameras for the NVS benchmark: what is in the archive, and what they show."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest
from typer.testing import CliRunner

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import read_scene, write_scene
from facefolds_core.cli import app
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.rendering.opengl import OpenGLRenderer
from tests.assets import make_asset
from tests.pictures import psnr
from tests.scenes import look_at_origin, make_scene

MOVE = Similarity(0.01, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.1, 0.2, -0.05]))
"""From the capture to the scene."""
SIZE = (44, 64)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Camera]:
    """A folder with asset/, scene/ and the capture 388/, and its hidden camera as the scene sees it."""
    root = tmp_path_factory.mktemp("submission")
    make_asset(root / "asset")
    make_scene(root / "scene", cameras=3, size=16, frames=1)
    write_scene(replace(read_scene(root / "scene"), from_capture=MOVE), root / "scene")
    seen = look_at_origin("222200037", 12.0, 5.0, 64)
    K = np.array([[70.0, 0, 23], [0, 71.0, 31], [0, 0, 1]])
    hidden = Camera("222200037", K, seen.w2c, *SIZE)
    in_capture = hidden.transformed(MOVE.inverse())
    (root / "388" / "calibration").mkdir(parents=True)
    value = {
        "world_2_cam": {hidden.name: [*in_capture.w2c.tolist(), [0, 0, 0, 1]]},
        "intrinsics": {hidden.name: hidden.K.tolist()},
    }
    (root / "388" / "calibration" / "camera_params.json").write_text(json.dumps(value))
    return root, hidden


def run(root: Path, out: Path, *more: str) -> tuple[int, str]:
    arguments = ["submission", str(root / "asset"), str(root / "388"), str(out), "--size", "44x64", *more]
    result = CliRunner().invoke(app, arguments)
    return result.exit_code, result.output


def frames_of(path: Path) -> tuple[list[np.ndarray], float]:
    with av.open(str(path)) as container:
        rate = container.streams.video[0].average_rate
        assert rate is not None
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)], float(rate)


def test_it_has_the_films_that_the_renderer_shows(project: tuple[Path, Camera], tmp_path: Path) -> None:
    root, hidden = project
    out = tmp_path / "out.zip"
    code, words = run(root, out, "--sequence", "GLASSES", "--camera", "222200037", "--samples", "1")
    assert code == 0, words
    asset = read_asset(root / "asset")
    with zipfile.ZipFile(out) as archive:
        assert archive.namelist() == ["388/GLASSES/cam_222200037.mp4"]
        film = Path(archive.extract("388/GLASSES/cam_222200037.mp4", tmp_path))
    pictures, rate = frames_of(film)
    assert (len(pictures), rate) == (asset.full.num_frames, 73.0)
    with OpenGLRenderer(asset.full) as renderer:
        for k, picture in enumerate(pictures):
            expected = renderer.render(hidden, k, (1.0, 1.0, 1.0))[0]
            grey = picture.mean(-1) / 255  # colours are stored at half the resolution
            assert psnr(grey, expected.mean(-1)) > 35
    assert np.ptp(pictures[0]) > 50


def test_films_of_several_sequences_share_an_archive(project: tuple[Path, Camera], tmp_path: Path) -> None:
    root, _ = project
    out = tmp_path / "out.zip"
    for sequence in ("FREE", "HAIR", "FREE"):
        assert run(root, out, "--sequence", sequence, "--camera", "222200037", "--samples", "1")[0] == 0
    with zipfile.ZipFile(out) as archive:
        assert sorted(archive.namelist()) == ["388/FREE/cam_222200037.mp4", "388/HAIR/cam_222200037.mp4"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--sequence", "FREE"), "cameras that the calibration does not have"),
        (("--sequence", "../FREE"), "no sequence of the dataset"),
        (("--sequence", "FREE", "--participant", "x"), "no participant of the dataset"),
        (("--sequence", "FREE", "--scene", "nowhere"), "file not found"),
    ],
)
def test_mistakes(project: tuple[Path, Camera], tmp_path: Path, more: tuple[str, ...], words: str) -> None:
    code, output = run(project[0], tmp_path / "out.zip", *more)
    assert code == 1 and words in output
    assert not (tmp_path / "out.zip").exists()


def test_a_file_that_is_no_archive_stays(project: tuple[Path, Camera], tmp_path: Path) -> None:
    out = tmp_path / "out.zip"
    out.write_bytes(b"something else")
    code, output = run(project[0], out, "--sequence", "FREE", "--camera", "222200037", "--samples", "1")
    assert code == 1 and "not a zip archive" in output
    assert out.read_bytes() == b"something else"
