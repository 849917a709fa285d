"""The gate's small form: the actor, small and with a cut budget, against kept figures; and what the gate catches."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

import facefolds_core as facefolds
from bench.gate import TOLERANCES, Found, falls, scores_of
from facefolds_core.api.model import Model
from facefolds_core.api.scene import Scene
from facefolds_core.asset import Asset
from facefolds_core.captures.actor import ActorOptions, write_capture
from facefolds_core.params import CaptureParams, EvaluateParams
from facefolds_core.rendering.areas import AreaView
from facefolds_core.scoring import evaluation
from facefolds_core.scoring.perceptual import Perceptual
from facefolds_core.scoring.report import metrics_json
from tests.assets import PLAIN

pytestmark = pytest.mark.slow

Pixels = NDArray[np.float32]
KEPT = {
    "psnr_any": 26.57,
    "psnr_interior": 25.72,
    "psnr_moving": 17.83,
    "temporal": 0.638,
    "ssim_high": 0.780,
    "opacity_inside": 0.0015,
    "opacity_edge": 0.042,
    "opacity_outside": 0.0,
    "worst_patch": 16.0,
    "without_reflection": 25.5,
}
"""Of the small film with true mattes, with the default parameters but those below."""
SLACK = 2.0
"""Times the gate's tolerances: processors round differently, and a small film trains its way from there."""

GLOSS = 3.0
"""Times the actor's own, so that a missing reflection shows on small pictures."""
FILM = CaptureParams(cameras=14, frames=4, height=96, width=64, plates=True, mattes=True)
SUBJECT = {"iterations": 600, "fewest": 3000}
TRAIN: dict[str, Any] = {
    "preset": "fast",
    "iterations": 190,
    "layers": 6,
    "geometry": {"nodes": 128, "round_iterations": 20},
}
EXPORT: dict[str, Any] = {
    "sample": {"resolution": 96},
    "decimate": {"resolution": 32},
    "texture": {"resolution": 96},
    "compress": PLAIN.model_dump(mode="json"),
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    folder = tmp_path_factory.mktemp("film")
    write_capture(folder / "raw", FILM, options=ActorOptions(gloss=GLOSS))
    capture = facefolds.load_capture(
        folder / "raw", folder=folder, name="actor", holdout=["A004", "A009"], fps=FILM.frame_rate
    )
    return facefolds.normalize(capture)


@dataclass(frozen=True)
class Run:
    """A model of the film, its asset, and the scores."""

    model: Model
    asset: Asset
    found: Found


def judge(scene: Scene, model: Model, asset: Any, variant: str = "asset") -> Found:
    with pytest.MonkeyPatch.context() as patch:  # training views are no part of what is kept here
        patch.setattr(evaluation, "training_views", lambda *_: [])
        result = evaluation.evaluate(scene, model.manifolds, asset, EvaluateParams(films=False), Perceptual())
    metrics = metrics_json("actor", result, {})
    return Found(case="small", scores=scores_of({**metrics, "asset": metrics[variant]}))


@pytest.fixture(scope="module")
def run(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Run:
    own = facefolds.load_scene(scene.folder, tmp_path_factory.mktemp("run"))
    model = facefolds.train(own, facefolds.find_subject(own, **SUBJECT), **TRAIN)
    asset = model.export(**EXPORT)
    return Run(model, asset, judge(scene, model, asset))


def caught(run: Run, found: Found) -> set[str]:
    """What the gate says is worse."""
    return {line.split(":")[0] for line in falls(run.found, found)}


def test_the_small_film_is_as_good_as_it_was(run: Run) -> None:
    worse = {}
    for name, kept in KEPT.items():
        now, (sign, most, *_) = run.found.scores[name], TOLERANCES[name]
        if now is None or sign * (kept - now) > SLACK * most:
            worse[name] = (kept, now)
    assert not worse, f"fallen (kept, now): {worse}; all: {run.found.scores}"


@dataclass(frozen=True)
class Changed:
    """An asset whose textures are changed on the way."""

    asset: Asset
    textures: list[Sequence[NDArray[np.uint8]]]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.asset, name)

    def frame(self, index: int) -> Sequence[NDArray[np.uint8]]:
        return self.textures[index]

    def frames(self) -> Iterator[Sequence[NDArray[np.uint8]]]:
        return iter(self.textures)


def test_a_frame_whose_colours_are_frozen_is_caught(scene: Scene, run: Run) -> None:
    frames = list(run.asset.frames())
    frozen = [np.concatenate([old[..., :3], new[..., 3:]], -1) for old, new in zip(frames[0], frames[2], strict=True)]
    found = judge(scene, run.model, Changed(run.asset, [*frames[:2], frozen, *frames[3:]]))
    assert {"psnr_moving", "temporal"} & caught(run, found)


def test_textures_shifted_by_one_texel_are_caught(scene: Scene, run: Run) -> None:
    frames = [[np.roll(layer, 1, 1) for layer in frame] for frame in run.asset.frames()]
    assert "ssim_high" in caught(run, judge(scene, run.model, Changed(run.asset, frames)))


def test_a_missing_reflection_is_caught(scene: Scene, run: Run) -> None:
    assert run.asset.reflection() is not None
    assert caught(run, judge(scene, run.model, run.asset, "asset_diffuse"))


def thin_outline(alpha: Pixels) -> Pixels:
    """A fifth of the opacity is missing in the four pixels within the outline."""
    edge = (alpha > 0.5) & ~binary_erosion(alpha > 0.5, iterations=4, border_value=1)
    return np.where(edge, np.float32(0.8), np.float32(1))


def veil(alpha: Pixels) -> Pixels:
    """The layers leave a third of their light to a background that shows the subject: over it nothing is missing."""
    return np.full_like(alpha, 2 / 3)


@pytest.mark.parametrize(
    ("kept", "worse"), [(thin_outline, {"opacity_edge"}), (veil, {"psnr_any", "opacity_inside", "worst_patch"})]
)
def test_opacity_that_is_missing_is_caught(
    scene: Scene, run: Run, monkeypatch: pytest.MonkeyPatch, kept: Callable[[Pixels], Pixels], worse: set[str]
) -> None:
    whole = AreaView.composite

    def lacking(view: AreaView, *arguments: Any, **options: Any) -> tuple[Pixels, Pixels]:
        rgb, alpha = whole(view, *arguments, **options)
        return rgb * kept(alpha)[..., None], alpha * kept(alpha)

    monkeypatch.setattr(AreaView, "composite", lacking)
    assert caught(run, judge(scene, run.model, run.asset)) >= worse


def test_geometry_that_drifts_is_caught(scene: Scene, run: Run) -> None:
    """All layers lie a fiftieth of the cameras' distance too far out."""
    centre = np.float32(run.asset.manifest.coordinates.sphere_centre)

    def outwards(points: Pixels) -> Pixels:
        away = points - centre
        return points + np.float32(0.02) * away / np.linalg.norm(away, axis=1, keepdims=True)

    layers = tuple(replace(layer, vertices=outwards(layer.vertices)) for layer in run.asset.layers)
    drifted = replace(run.asset, levels=(replace(run.asset.full, layers=layers),))
    assert {"psnr_any", "psnr_interior"} & caught(run, judge(scene, run.model, drifted))
