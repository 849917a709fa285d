"""A tiny evaluated subject: spheres filmed by seven cameras, three caps as its asset, made-up scores and records."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.files import write_json, write_text
from facefolds_core.params import section_of
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.evaluation import METRICS, SUBJECT_METRICS, VARIANTS, ImageScore
from facefolds_core.scoring.report import metrics_json, write_per_image
from tests.assets import make_asset
from tests.scenes import make_scene

FRAMES = 3
LAYERS = 3
STEPS = ("model", "sampled", "shipped")


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


def make_subject(root: Path, masks: bool = True) -> SubjectFolders:
    """Write all that `dvc repro` and the measurement of the export would leave, as far as the report reads it."""
    folders = SubjectFolders(root)
    make_scene(folders.scene, frames=FRAMES)
    if not masks:
        (folders.scene / "masks.arrow").unlink()
    make_asset(folders.asset, layers=LAYERS, frames=FRAMES, resolution=32)
    cost = {"train_seconds": 12.5, "iterations": 300, "device": "cpu (2 threads)", "triangles": 726}
    write_json(folders.metrics, metrics_json("spheres", scores(masks), cost))
    folders.evaluation.mkdir()
    write_per_image(scores(masks), folders.evaluation / "per_image.parquet")
    write_json(folders.model / "training.json", {"preset": "fast", "seconds": 12.5})
    write_json(folders.model / "fit.json", {"reasons": ["centre: <the middle>"], "events": []})
    write_text(folders.training_log / "plots" / "metrics" / "psnr.tsv", "step\tpsnr\n0\t10\n1\tnan\n2\t20\n")
    for i, stage in enumerate(("train", "compress")):
        write_json(folders.timing(stage), {"stage": stage, "seconds": 10.0 + i})
    for name in ("train", "evaluate"):
        write_json(folders.config / f"{name}.json", section_of(name, {}).model_dump(mode="json"))
    steps = [
        {"name": name, "psnr": 25.0 - i, "triangles": 0, "mesh_bytes": 0, "texture_bytes": i}
        for i, name in enumerate(STEPS)
    ]
    write_json(folders.root / "waterfall" / "waterfall.json", {"subject": "spheres", "steps": steps})
    return folders
