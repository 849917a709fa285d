"""The pipeline as a library: from a scene to a model, an asset and its scores, without DVC and without its folders.

    import facefolds_core as facefolds

    scene = facefolds.load_scene("data/actor/scene")
    trained = facefolds.train(scene, facefolds.train_params({"preset": "fast"}))
    asset = facefolds.export_asset(trained.model, scene, "face")
    scores = facefolds.evaluate(asset, scene, trained.model)

The stages (stages/*.py) call the same functions on files.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from facefolds_core.asset.reader import Asset, read_asset
from facefolds_core.captures.scene import Scene
from facefolds_core.export import steps
from facefolds_core.export.textures import resample_store
from facefolds_core.model import RadianceManifolds
from facefolds_core.model.device import pick_device
from facefolds_core.packaging.package import Export, package
from facefolds_core.params import (
    BakeParams,
    CompressParams,
    DecimateParams,
    EvaluateParams,
    ExplicitParams,
    ReconstructParams,
    SampleParams,
    Section,
    TextureParams,
    TrainParams,
)
from facefolds_core.scoring.evaluation import Evaluation
from facefolds_core.scoring.evaluation import evaluate as score
from facefolds_core.scoring.perceptual import Perceptual, find_perceptual
from facefolds_core.training.models import fit
from facefolds_core.training.trained import Trained


class ExportParams(Section):
    """Sections of params.yaml that concern the export, each with its defaults."""

    sample: SampleParams = SampleParams()
    reconstruct: ReconstructParams = ReconstructParams()
    decimate: DecimateParams = DecimateParams()
    texture: TextureParams = TextureParams()
    bake: BakeParams = BakeParams()
    compress: CompressParams = CompressParams()


def train(scene: Scene, params: TrainParams | None = None, scratch: str | Path | None = None) -> Trained:
    """Fit a model to the training cameras of a scene. `Trained.save` writes it as the stage `train` does.

    Args:
        params: of either model; by default the preset `fast`.
        scratch: folder of the log and, of the perceptrons, of checkpoints, from which a later call with the same
            parameters goes on; of a take that is trained in segments, of these. By default there is none.

    Raises:
        UserError: if an image or its matte is missing, there is no subject, or training diverges.
    """
    params = ExplicitParams() if params is None else params
    with TemporaryDirectory(prefix="facefolds-train-") as temporary:
        folder = Path(temporary if scratch is None else scratch)
        return fit(scene, params, folder / "checkpoints", folder / "log")


def export_asset(
    model: RadianceManifolds,
    scene: Scene,
    folder: str | Path,
    params: ExportParams | None = None,
    key_frames: Sequence[int] | None = None,
) -> Asset:
    """Make the asset of a model: sample, reconstruct, decimate, texture, bake, compress.

    Args:
        folder: of the asset; written whole or not at all.
        params: of the steps; by default as they stand in the sections' defaults.
        key_frames: of a take that was trained in segments, for `sample.opacity: key_frames`.

    Returns:
        the asset, as read from its files.

    Raises:
        UserError: if model and scene do not belong together, or the result cannot be an asset.
    """
    params = ExportParams() if params is None else params
    steps.check_frames(model, scene)
    with TemporaryDirectory(prefix="facefolds-export-") as temporary:
        sampled, resampled, baked = (Path(temporary) / name for name in ("sampled", "resampled", "baked"))
        for place in (sampled, resampled, baked):
            place.mkdir()
        views = scene.views_of("train", steps.SAMPLED_VIEWS)
        grids = steps.sample_model(model, views, params.sample, sampled, keys=key_frames)
        surfaces = steps.surfaces_in(steps.reconstruct(grids, params.reconstruct))
        stores = (sampled / steps.TEXTURES, resampled / steps.TEXTURES)
        wanted = sorted({level.mesh_resolution for level in params.compress.levels})
        meshes = steps.decimate_all(surfaces, grids, scene, stores[0], params.decimate, wanted)
        resample_store(*stores, steps.texels_for(scene, meshes.meshes, grids, stores[0], params.texture)[0])
        views = scene.views_of("train", steps.BAKED_VIEWS)
        steps.bake(views, grids, meshes.meshes, *stores, params.bake, baked)
        made = Export.of(grids, meshes.meshes, baked / steps.TEXTURES, meshes.coarser)
        package(Path(folder), made, scene, params.compress)
    return read_asset(folder)


def evaluate(
    asset: Asset,
    scene: Scene,
    model: RadianceManifolds,
    params: EvaluateParams | None = None,
    perceptual: Perceptual | None = None,
) -> Evaluation:
    """Score an asset, and the model that it was made of, on the scene's held-out cameras (docs/reference/metrics.md).

    Args:
        perceptual: the perceptual metrics; by default those whose weights are on this machine.

    Raises:
        UserError: if there is no held-out camera, or the three do not belong together.
    """
    params = EvaluateParams() if params is None else params
    perceptual = find_perceptual(pick_device("auto")) if perceptual is None else perceptual
    return score(scene, model, asset, params, perceptual)
