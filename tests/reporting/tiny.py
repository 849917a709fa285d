"""A tiny evaluated subject: spheres filmed by seven cameras, three caps as its asset, made-up scores and records."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from PIL import Image

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import read_scene
from facefolds_core.facts import fact
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import read_json, write_json, write_text
from facefolds_core.params import section_of
from facefolds_core.rendering.reference import AssetCaster, composite
from facefolds_core.scoring.films import FILMS, FilmFolder
from facefolds_core.scoring.metrics import shown
from facefolds_core.scoring.panels import METRICS, SUBJECT_METRICS, VARIANTS, ImageScore, Panel
from facefolds_core.scoring.pictures import WORST, write_contact_sheet, write_worst
from facefolds_core.scoring.report import metrics_json, write_per_image
from tests.assets import make_asset
from tests.scenes import make_scene
from tests.scoring.fakes import evaluation

FRAMES = 3
LAYERS = 3


def scores(subject: bool) -> list[ImageScore]:
    """PSNR 20, 21 and 22 dB for the model's frames, 1 dB less for the asset; 5 dB more for the subject."""
    found = []
    for k in range(FRAMES):
        for variant in VARIANTS:
            values: dict[str, float | None] = dict.fromkeys((*METRICS, *SUBJECT_METRICS))
            values |= {"psnr": 20.0 + k - (variant == "asset"), "ssim": 0.8}
            if subject:
                values |= {"psnr_subject": 25.0 + k - (variant == "asset"), "ssim_subject": 0.9}
            found.append(ImageScore("cam3", f"{k:06d}", variant, values))
    return found


def write_seen(folders: SubjectFolders, masks: bool) -> None:
    """Pictures and films of the held-out camera, all frames on the contact sheet; the first one is the worst."""
    scene, asset = read_scene(folders.scene), read_asset(folders.asset)
    (index,) = scene.indices("holdout")
    truths, opacity = scene.open_frames(), scene.open_masks()
    hits, panels = AssetCaster(asset).cast(scene.cameras[index]), []
    found = {(s.frame, s.variant): s for s in scores(masks)}
    for k, textures in enumerate(asset.frames()):
        frame = scene.frame_ids[k]
        picture, truth = shown(composite(hits, textures)[0]), truths.image(index, k) / 255.0
        mask = None if opacity is None else opacity.image(index, k)[..., 0] / 255.0
        both = found[frame, "model"], found[frame, "asset"]
        panels.append(Panel(scene.cameras[index].name, frame, truth, picture, picture, *both, mask))
    rolls = FilmFolder(folders.evaluation, 30.0)
    with rolls.roll(scene.cameras[index].name) as roll:
        assert roll is not None
        for panel in panels:
            roll.add(panel.frame, panel.truth, panel.shown)
    write_json(folders.evaluation / FILMS, [asdict(film) for film in rolls.files])
    write_worst(folders.evaluation / WORST, panels[0], None)
    metrics = read_json(folders.metrics)
    write_contact_sheet(folders.evaluation / "contact_sheet.png", "spheres", panels, metrics)


def make_subject(root: Path, masks: bool = True) -> SubjectFolders:
    """Write all that `dvc repro` and the measurement of the export would leave, as far as the report reads it."""
    folders = SubjectFolders(root)
    make_scene(folders.scene, frames=FRAMES)
    if not masks:
        (folders.scene / "masks.arrow").unlink()
    make_asset(folders.asset, layers=LAYERS, frames=FRAMES, resolution=32)
    Image.new("RGB", (24, 32), (90, 60, 40)).save(folders.asset / "poster.jpg")
    cost = {"train_seconds": 12.5, "iterations": 300, "device": "cpu (2 threads)", "triangles": 726}
    cost |= {"mesh_bytes": 1000, "texture_bytes": 2000, "reflection_bytes": 4000}
    write_json(folders.metrics, metrics_json("spheres", evaluation(scores(masks)), cost))
    folders.evaluation.mkdir()
    write_per_image(scores(masks), folders.evaluation / "per_image.parquet")
    write_seen(folders, masks)
    write_json(folders.model / "training.json", {"preset": "fast", "seconds": 12.5})
    reason = fact("texels_chosen", pixels=1.5)
    write_json(folders.model / "fit.json", {"reasons": [reason.to_json()], "events": ["level 3: <diverged>"]})
    write_text(folders.training_log / "plots" / "metrics" / "psnr.tsv", "step\tpsnr\n0\t10\n1\tnan\n2\t20\n")
    for i, stage in enumerate(("train", "compress")):
        write_json(folders.timing(stage), {"stage": stage, "seconds": 10.0 + i})
    for name in ("train", "evaluate"):
        write_json(folders.config / f"{name}.json", section_of(name, {}).model_dump(mode="json"))
    return folders
