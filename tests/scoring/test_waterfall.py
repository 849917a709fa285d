"""Steps of the export against what a known model with a reflection loses in them, and against what `evaluate` says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import SPHERE_CENTRE, Scene, Split, read_scene, write_scene
from facefolds_core.cli.waterfall import lines, measured_on
from facefolds_core.errors import UserError
from facefolds_core.export import steps
from facefolds_core.export.stores import read_grids, write_grids, write_meshes, write_sheets
from facefolds_core.export.textures import resample_store
from facefolds_core.frame_store import write_frames
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.geometry.track import Track
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.storage import ExplicitSpec, build_model
from facefolds_core.packaging.package import Export, package
from facefolds_core.params import (
    BakeParams,
    CompressParams,
    DecimateParams,
    EvaluateParams,
    ReconstructParams,
    SampleParams,
)
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering import Hits
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.scoring import export_steps
from facefolds_core.scoring.evaluation import evaluate
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.perceptual import Perceptual, PerceptualDistance
from facefolds_core.scoring.truths import MatteKind
from facefolds_core.scoring.waterfall import STEPS, Step, waterfall
from tests.scenes import make_scene

NO_WEIGHTS = Perceptual(None, None, ())
WINDOW = (-0.6, 0.6, -0.6, 0.6)
R, SIZE, FRAMES = 32, 48, 2


def glossy_model() -> RadianceManifolds:
    """Two balls with waves, nearly opaque in the middle of the window, whose reflection adds up to 0.3."""
    spec = ExplicitSpec(
        centre=SPHERE_CENTRE, window=WINDOW, nodes=(24, 24), texels=(R, R), num_layers=2, num_frames=FRAMES,
        reflection=(8, 8, 8),
    )  # fmt: skip
    model, rng = build_model(spec).eval(), np.random.default_rng(0)
    assert isinstance(model.manifolds, RadialManifolds) and isinstance(model.textures, GridTextures)
    model.manifolds.middle.data.fill_(0.32)
    model.manifolds.halfwidth.data.fill_(0.01)
    reflection = model.textures.reflection
    assert reflection is not None
    wave = np.sin(np.arange(R) / 3)
    picture = 0.4 + 0.2 * np.stack([np.add.outer(wave, a * wave) / 2 for a in (0, 0.5, 1)], -1)
    model.textures.colour.data = torch.tensor(picture, dtype=torch.float32)
    rim = np.hypot(*np.meshgrid(*[np.linspace(-1, 1, R)] * 2))[..., None]
    model.textures.layers.data[..., 3] = torch.tensor(4 - 20 * np.maximum(rim - 0.5, 0)).float()
    model.textures.frame_colour.data[1] = 0.1
    reflection.gloss.data.fill_(1)
    reflection.normals.data = torch.tensor([1.0, 0, 0]) + torch.tensor(rng.normal(0, 0.2, (8, 8, 3))).float()
    reflection.environment.data = torch.tensor(np.linspace(0, 0.3, 64).reshape(8, 8, 1).repeat(3, 2)).float()
    return model


def turning() -> Track:
    """A head that nods by 12 degrees between its two frames."""
    quaternions = Rotation.from_euler("y", [[0.0], [12.0]], degrees=True).as_quat(scalar_first=True)
    return Track(quaternions, np.zeros((FRAMES, 3)))


def photograph(scene: Scene, model: RadianceManifolds) -> None:
    """The model as it is, reflection and all, by every camera: photos and masks of the scene."""
    photos, masks = [], []
    for i in range(len(scene.cameras)):
        for k in range(FRAMES):
            to_room = None if scene.poses is None else scene.poses.at(k).rotation
            rgb, _, alpha = ModelView(model, scene.camera_in_head(i, k), to_room).render(k)
            photos.append((i, k, codes(rgb)))
            masks.append((i, k, codes(alpha[..., None])))
    write_frames(scene.folder / "frames.arrow", (SIZE, SIZE, 3), photos)
    write_frames(scene.folder / "masks.arrow", (SIZE, SIZE, 1), masks)


def codes(image: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.rint(255 * image).astype(np.uint8)


def export(folders: SubjectFolders, scene: Scene, model: RadianceManifolds) -> None:
    """All that the stages leave: textures of half the samples, not fitted."""
    stores = (folders.samples, folders.surfaces, folders.meshes, folders.resampled, folders.textures)
    for folder in stores:
        folder.mkdir()
    views = scene.views_of("train", FRAMES)
    grids = steps.sample_model(model, views, SampleParams(resolution=R, window="full"), folders.samples)
    write_grids(folders.samples / "grids.npz", grids)
    sheets = steps.surfaces_in(steps.reconstruct(grids, ReconstructParams()))
    assert not isinstance(sheets, list)
    write_sheets(folders.surfaces / "surfaces.npz", sheets)
    meshes = steps.decimate(sheets, grids, DecimateParams(), [12])[12]
    write_meshes(folders.meshes / "meshes.npz", meshes)
    sampled, resampled, baked = (one / steps.TEXTURES for one in (stores[0], stores[3], stores[4]))
    resample_store(sampled, resampled, R // 2)
    steps.bake(views, grids, meshes, sampled, resampled, BakeParams(iterations=0), baked.parent)
    package(folders.asset, Export.of(grids, meshes, baked, {}), scene, CompressParams(levels=()))


def subject(root: Path, poses: Track | None = None) -> tuple[SubjectFolders, Scene, RadianceManifolds]:
    folders, model = SubjectFolders(root), glossy_model()
    scene = replace(make_scene(folders.scene, cameras=5, size=SIZE, frames=FRAMES), poses=poses)
    write_scene(scene, folders.scene)
    photograph(scene, model)
    export(folders, scene, model)
    return folders, read_scene(folders.scene), model


Subject = tuple[SubjectFolders, Scene, RadianceManifolds]


@pytest.fixture(scope="module", params=["still", "turning"])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return subject(tmp_path_factory.mktemp("steps") / "ball", turning() if request.param == "turning" else None)


def measured(made: Subject, st_lpips: PerceptualDistance | None = None, frames: int = FRAMES) -> list[Step]:
    folders, scene, model = made
    return waterfall(scene, model, folders, frames, st_lpips).steps


def test_all_steps_have_the_reflection(made: Subject) -> None:
    """The photos are of a model with it: without it none comes near."""
    found = {step.name: step for step in measured(made)}
    assert tuple(found) == STEPS
    assert found["model"].psnr > 55 and found["model"].psnr_to_model is None
    assert found["model"].ssim_high > 0.99
    for name, least in zip(STEPS[1:], (50, 48, 46, 38, 38, 36), strict=True):
        assert found[name].psnr > least, name
        assert found[name].ssim > 0.99 and found[name].ssim_high > 0.99, name
        to_model = found[name].psnr_to_model
        assert to_model is not None and abs(to_model - found[name].psnr) < 1


def test_what_ships_has_the_scores_that_evaluate_gives_it(made: Subject) -> None:
    folders, scene, model = made
    step, asset = measured(made)[-1], read_asset(folders.asset)
    scores = evaluate(scene, model, asset, EvaluateParams(), NO_WEIGHTS).scores
    for name, value in (("psnr_subject", step.psnr), ("ssim_subject", step.ssim)):
        assert value == pytest.approx(np.mean([s.values[name] for s in scores if s.variant == "asset"]))
    level = asset.manifest.full
    assert level.reflection is not None
    assert step.texture_bytes == level.texture.videos[0].bytes + level.reflection.bytes


class Difference:
    """Stands for ST-LPIPS."""

    shift = torch.zeros(1)

    def __call__(self, images: torch.Tensor, truth: torch.Tensor) -> torch.Tensor:
        return (images - truth).abs().mean((1, 2, 3))


def test_st_lpips_is_measured_where_there_is_one(made: Subject) -> None:
    distance = cast(PerceptualDistance, Difference())
    found = measured(made, distance, 1)
    values = [step.st_lpips for step in found]
    assert values[0] is not None and values[-1] is not None and values[0] < values[-1]
    said = lines("ball", found)
    assert len(said) == 1 + len(STEPS) and f"{values[-1]:.4f}" in said[-1]
    assert len({len(line) for line in said}) == 1
    without = measured(made, None, 1)
    assert {step.st_lpips for step in without} == {None}
    assert [step.psnr for step in without] == [step.psnr for step in found]
    assert len({len(line) for line in lines("ball", without)}) == 1


def test_without_a_reflection_the_model_is_shown_without_its_view_branch(tmp_path: Path) -> None:
    folders, scene, model = subject(tmp_path / "ball")
    write_grids(folders.samples / "grids.npz", replace(read_grids(folders.samples / "grids.npz"), reflection=None))
    found = {step.name: step for step in waterfall(scene, model, folders, 1, None).steps}
    assert found["model"].psnr < 25  # of photos with one
    sampled = found["sampled"].psnr_to_model
    assert sampled is not None and sampled > 40


def test_meshes_that_are_the_same_are_cast_once_a_camera(made: Subject, monkeypatch: pytest.MonkeyPatch) -> None:
    times = []

    def counted(camera: Camera, layers: Sequence[TexturedMesh]) -> Hits:
        times.append(1)
        return cast_layers(camera, layers)

    monkeypatch.setattr(export_steps, "cast_layers", counted)
    folders, scene, model = made
    found = waterfall(scene, model, folders, FRAMES, None)
    assert len(times) == 2 * (1 if scene.poses is None else found.images)


Masks = Mapping[tuple[Split, int], bool]
"""By the camera's split and the frame: whether a mask shows the subject, or is empty."""


def masked(made: Subject, folder: Path, masks: Masks, photos: bool = True) -> Subject:
    """The same subject with one camera for validation and one held out, and no other masks."""
    folders, scene, model = made
    cameras: dict[Split, int] = {"validate": 1, "holdout": 2}
    true, frames = scene.open_masks(), scene.open_frames()
    assert true is not None
    folder.mkdir()
    kept = [(cameras[split], k, true.image(cameras[split], k) * np.uint8(full)) for (split, k), full in masks.items()]
    write_frames(folder / "masks.arrow", (SIZE, SIZE, 1), kept)
    write_frames(folder / "frames.arrow", (SIZE, SIZE, 3), [(*key, frames.image(*key)) for key in frames if photos])
    splits: tuple[Split, ...] = ("train", "validate", "holdout", "train", "train")
    return folders, replace(scene, splits=splits, folder=folder), model


@pytest.mark.parametrize(
    ("masks", "region", "split", "metric"),
    [
        ({("holdout", 0): True}, "true", "holdout", "psnr_subject"),
        ({("holdout", 1): True}, "true", "holdout", "psnr_subject"),
        ({("validate", 0): False, ("holdout", 0): True}, "true", "holdout", "psnr_subject"),
        ({("validate", 1): True, ("holdout", 0): True}, "true", "validate", "psnr_subject"),
        ({("validate", 0): False, ("validate", 1): True}, "true", "validate", "psnr_subject"),
        ({}, "found", "validate", "psnr_found"),
    ],
    ids=["first", "last", "elsewhere", "both", "one_empty", "none"],
)
def test_pictures_and_pixels_are_those_of_evaluate(
    made: Subject, tmp_path: Path, masks: Masks, region: MatteKind, split: Split, metric: str
) -> None:
    folders, scene, model = masked(made, tmp_path / "scene", masks)
    found = waterfall(scene, model, folders, FRAMES, None)
    told = evaluate(scene, model, read_asset(folders.asset), EvaluateParams(), NO_WEIGHTS)
    for variant, step in (("model", found.steps[0]), ("asset", found.steps[-1])):
        own = [s.values[metric] for s in told.scores if (s.variant, s.split) == (variant, split)]
        values = [value for value in own if value is not None]
        assert len(values) == found.images and step.psnr == pytest.approx(np.mean(values))
    assert (found.region, found.split) == (region, split) and told.matte == region
    one = waterfall(scene, model, folders, 1, None)
    assert (one.region, one.split, one.images) == (region, split, 1)
    assert "pictures: 1, " in measured_on(one) and f"region: {region}, " in measured_on(one)


def test_without_pictures_of_the_subject_there_is_one_message(made: Subject, tmp_path: Path) -> None:
    empty: Masks = {("validate", 1): False, ("holdout", 0): False}
    folders, scene, model = masked(made, tmp_path / "empty", empty)
    with pytest.raises(UserError, match=r"no mask of a scored photo shows the subject[\s\S]*masks\.arrow"):
        waterfall(scene, model, folders, FRAMES, None)
    folders, scene, model = masked(made, tmp_path / "dark", empty, photos=False)
    with pytest.raises(UserError, match=r"has a photo[\s\S]*frames\.arrow"):
        waterfall(scene, model, folders, FRAMES, None)


def test_mattes_that_are_empty_are_passed_over(made: Subject, tmp_path: Path) -> None:
    splits: tuple[Split, ...] = ("validate", "holdout")
    for seen in (True, False):
        mattes = {(split, k): seen and (split, k) == ("validate", 1) for split in splits for k in range(FRAMES)}
        folders, scene, model = masked(made, tmp_path / f"{seen}", mattes)
        (scene.folder / "masks.arrow").rename(scene.folder / "mattes.arrow")
        if seen:
            found = waterfall(scene, model, folders, 1, None)
            assert (found.region, found.split, found.images) == ("scene", "validate", 1)
        else:
            with pytest.raises(UserError, match=r"no matte of a scored photo[\s\S]*mattes\.arrow"):
                waterfall(scene, model, folders, 1, None)


def test_what_a_transparent_model_shows_is_compared_with_nothing(made: Subject, tmp_path: Path) -> None:
    folders, scene, _ = masked(made, tmp_path / "scene", {})
    model = glossy_model()
    assert isinstance(model.textures, GridTextures)
    model.textures.layers.data[..., 3] = -20
    with pytest.raises(UserError, match="the model is transparent"):
        waterfall(scene, model, folders, 1, None)
