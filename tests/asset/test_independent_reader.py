"""The document is enough: a player written from it alone sees what `evaluate` scores."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.params import EvaluateParams
from facefolds_core.scoring.evaluation import evaluate
from facefolds_core.scoring.perceptual import Perceptual
from tests.asset.filmed import HELD_OUT, SIZE, filmed, packaged
from tests.asset.independent_reader import Player
from tests.scoring.fakes import tiny_model


@pytest.mark.parametrize("codec", ["h264", "vp9"])
def test_its_score_is_evaluates(tmp_path: Path, codec: str) -> None:
    scene = filmed(tmp_path / "scene")
    section = {
        "video": {"codec": codec, "crf": 20},
        "mesh": {"max_error_pixels": 0.1, "compression_level": 7},
        "view_effects": True,
    }
    packaged(tmp_path / "asset", scene, section)
    asset = read_asset(tmp_path / "asset")
    assert asset.effects() is not None
    scores = evaluate(scene, tiny_model(), asset, EvaluateParams(), Perceptual(None, None, ())).scores
    ours = {v: [s.values["psnr"] for s in scores if s.variant == v] for v in ("asset", "asset_view")}

    player, camera = Player(tmp_path / "asset"), scene.cameras[HELD_OUT]
    y, x = np.mgrid[0:SIZE, 0:SIZE] + 0.5
    pixels, truths = np.stack([x.ravel(), y.ravel()], -1), scene.open_frames()
    view = player.look(camera.K, camera.w2c, pixels)
    for variant, effects in (("asset", False), ("asset_view", True)):
        for k, picture in enumerate(player.pictures()):
            seen = player.render(picture, view, effects)
            seen = np.rint(255 * np.clip(seen, 0, 1)) / 255
            error = ((seen - truths.image(HELD_OUT, k).reshape(-1, 3) / 255) ** 2).mean()
            score = ours[variant][k]
            assert score is not None and score > 20
            assert abs(-10 * np.log10(error) - score) < 0.1, (variant, k)
    means = [np.mean([v for v in values if v is not None]) for values in ours.values()]
    assert means[1] > means[0] + 0.5, means


def test_the_player_imports_nothing_of_ours() -> None:
    text = (Path(__file__).parent / "independent_reader.py").read_text()
    assert "import facefolds" not in text and "from facefolds" not in text
