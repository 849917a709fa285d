"""The document is enough: a player written from it alone sees what `evaluate` scores."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.params import EvaluateParams
from facefolds_core.scoring.evaluation import evaluate
from facefolds_core.scoring.perceptual import Perceptual
from tests.asset.filmed import HELD_OUT, SIZE, filmed, packaged
from tests.asset.independent_reader import Player
from tests.scoring.fakes import tiny_model
from tests.viewer.fixtures import random_reflection


def weak_reflection() -> ReflectionMaps:
    """Seen, and not so strong that the picture is all of it."""
    maps = random_reflection()
    return replace(maps, gloss=0.3 * maps.gloss, offset=0.3 * maps.offset)


@pytest.mark.parametrize("codec", ["h264", "vp9"])
def test_its_score_is_evaluates(tmp_path: Path, codec: str) -> None:
    scene = filmed(tmp_path / "scene")
    section = {"video": {"codec": codec, "crf": 20}, "mesh": {"max_error_pixels": 0.1, "compression_level": 7}}
    packaged(tmp_path / "asset", scene, section, weak_reflection())
    asset = read_asset(tmp_path / "asset")
    scores = evaluate(scene, tiny_model(), asset, EvaluateParams(), Perceptual()).scores
    ours = [s.values["psnr"] for s in scores if s.variant == "asset"]

    player, camera = Player(tmp_path / "asset"), scene.cameras[HELD_OUT]
    y, x = (np.mgrid[0 : 2 * SIZE, 0 : 2 * SIZE] + 0.5) / 2  # the format's filter: 2 x 2 rays a pixel
    pixels, truths = np.stack([x.ravel(), y.ravel()], -1), scene.open_frames()
    view = player.look(camera.K, camera.w2c, pixels)

    def score(picture: np.ndarray, frame: int, reflection: bool) -> float:
        rays = np.clip(player.render(picture, view, reflection), 0, 1).reshape(SIZE, 2, SIZE, 2, 3)
        seen = np.rint(255 * rays.mean((1, 3))).reshape(-1, 3) / 255
        return float(-10 * np.log10(((seen - truths.image(HELD_OUT, frame).reshape(-1, 3) / 255) ** 2).mean()))

    for k, (picture, expected) in enumerate(zip(player.pictures(), ours, strict=True)):
        for layer, texture in zip(player.level["layers"], asset.frame(k), strict=True):
            x, y, w, h = layer["texture_rect"]
            assert np.abs(255 * picture[y : y + h, x : x + w] - texture).max() < 0.51
        assert expected is not None and expected > 20
        assert abs(score(picture, k, reflection=True) - expected) < 0.03, k
        assert abs(score(picture, k, reflection=False) - expected) > 0.5, k  # it is strong enough to be seen here


@pytest.mark.parametrize("name", ["independent_reader.py", "independent_gltf_reader.py"])
def test_readers_import_nothing_of_ours(name: str) -> None:
    text = (Path(__file__).parent / name).read_text()
    assert "import facefolds" not in text and "from facefolds" not in text
