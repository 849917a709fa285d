"""The document is enough: a player written from it alone sees what `evaluate` scores."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.asset import read_asset
from facefolds_core.captures.frames import write_frames
from facefolds_core.captures.scene import Scene, write_scene
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.packaging.package import Export, package
from facefolds_core.packaging.views import Shown
from facefolds_core.params import CompressParams, EvaluateParams
from facefolds_core.rendering.reference import AssetCaster, composite
from facefolds_core.scoring.evaluation import evaluate
from facefolds_core.scoring.perceptual import Perceptual
from tests.asset.independent_reader import Player
from tests.assets import SOURCE, WINDOW, cap_mesh, cap_textures, radius_of, write_store
from tests.scenes import look_at_origin
from tests.scoring.fakes import tiny_model

SIZE, LAYERS, FRAMES, R = 48, 3, 3, 64
HELD_OUT = 8


def filmed(folder: Path) -> Scene:
    """The caps before any loss, as cameras saw them, with gloss: brighter from one side."""
    cameras = tuple(look_at_origin(f"c{i}", azimuth, 8, SIZE) for i, azimuth in enumerate(range(-40, 45, 8)))
    scene = Scene(
        subject="caps",
        cameras=cameras,
        splits=tuple("holdout" if i == HELD_OUT else "train" for i in range(len(cameras))),
        frame_ids=tuple(map(str, range(FRAMES))),
        times=np.arange(FRAMES) / 30,
        fps=30.0,
        from_capture=Similarity.identity(),
        left_out=(),
        folder=folder,
    )
    folder.mkdir(parents=True)
    caster = AssetCaster(Shown([cap_mesh(radius_of(i)) for i in range(LAYERS)]))
    rows = []
    for i, camera in enumerate(cameras):
        hits = caster.cast(camera)
        for k in range(FRAMES):
            rgb, alpha = composite(hits, list(cap_textures(LAYERS, k, R)))
            gloss = (0.15 * camera.centre[1] * alpha)[..., None]
            rows.append((i, k, np.rint(255 * np.clip(rgb + gloss, 0, 1)).astype(np.uint8)))
    write_frames(folder / "frames.arrow", (SIZE, SIZE, 3), rows)
    write_scene(scene, folder)
    return scene


@pytest.mark.parametrize("codec", ["h264", "vp9"])
def test_its_score_is_evaluates(tmp_path: Path, codec: str) -> None:
    scene = filmed(tmp_path / "scene")
    textures = write_store(tmp_path / "t.arrow", np.stack([cap_textures(LAYERS, frame, R) for frame in range(FRAMES)]))

    def caps(side: int) -> list[TexturedMesh]:
        return [cap_mesh(radius_of(i), side) for i in range(LAYERS)]

    export = Export(caps(12), [WINDOW] * LAYERS, textures, caps)
    section: dict[str, Any] = {
        "video": {"codec": codec, "crf": 20},
        "mesh": {"max_error_pixels": 0.1, "compression_level": 7},
        "view_effects": True,
    }
    # The tenth of the bytes of so small an asset is nothing.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("facefolds_core.packaging.package.EFFECTS_SHARE", 10.0)
        package(tmp_path / "asset", export, scene, SOURCE, CompressParams.model_validate(section))
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
