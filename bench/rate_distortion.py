"""Bytes against quality on held-out cameras: the paper's export and ours, from the same trained model.

python bench/rate_distortion.py data/actor --work build/rate [--chart docs/images/rate_distortion.png]

`paper`: the whole hemisphere, Poisson on 512 x 512 samples, 32 x 32 vertices a layer with the nearest sample's texture
coordinates, Draco without loss, 1024 x 1024 texels, H.264. `ours`: the sections of the subject's own configuration, as
`configure` left them, meshes by error in pixels. Both go through the same writer, which crops layers and leaves out
what shows nothing: that flatters the paper's. A point is one constant rate factor; the export stages run once a series.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import typer

from facefolds_core.asset import AssetSource, read_asset, write_asset
from facefolds_core.asset.cropping import crop_layers
from facefolds_core.captures.frames import FrameStore
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.errors import report_user_errors
from facefolds_core.export.stores import read_centre, read_meshes, read_windows
from facefolds_core.files import atomic_file, read_json, write_json
from facefolds_core.packaging.meshbits import resolved
from facefolds_core.packaging.views import training_cameras
from facefolds_core.params import CompressParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.rendering import AssetCaster, composite
from facefolds_core.scoring.metrics import psnr, shown
from stages.bake import bake
from stages.decimate import decimate
from stages.reconstruct import reconstruct
from stages.sample import sample
from stages.texture import texture

PAPER: dict[str, dict[str, Any]] = {
    "sample": {"resolution": 1024, "window": "full"},
    "reconstruct": {"method": "poisson", "resolution": 512},
    "decimate": {"resolution": 32, "uv": "nearest"},
    "texture": {"resolution": 1024},
    "bake": {"iterations": 0},
}
LOSSLESS_MESH = {"quantization_bits": 0, "compression_level": 0}
QUANTISED_MESH = {"max_error_pixels": 0.2, "compression_level": 10}
STAGES: tuple[Callable[[SubjectFolders], str], ...] = (sample, reconstruct, decimate, texture, bake)
FACTORS = (14, 18, 22, 26, 30, 34)
SCORED_FRAMES = 6


@dataclass(frozen=True)
class Point:
    """One asset: its bytes, and dB on the held-out cameras (the subject, where the capture has masks)."""

    series: str
    crf: int
    mesh_bytes: int
    video_bytes: int
    psnr: float

    @property
    def bytes(self) -> int:
        return self.mesh_bytes + self.video_bytes


def exported(subject: Path, work: Path, changes: dict[str, dict[str, Any]]) -> SubjectFolders:
    """Run the export stages of a trained subject in a folder of their own, with changed sections; once."""
    folders = SubjectFolders(work)
    if (folders.textures / "textures.arrow").exists():
        return folders
    work.mkdir(parents=True, exist_ok=True)
    for name in ("scene", "model"):
        (work / name).unlink(missing_ok=True)
        (work / name).symlink_to((subject / name).resolve())
    shutil.copytree(subject / "config", folders.config, dirs_exist_ok=True)
    for stage, section in changes.items():
        path = folders.config / f"{stage}.json"
        write_json(path, (read_json(path) if path.exists() else {}) | section)
    for run in STAGES:
        typer.echo(f"{work.name}: {run(folders)}")
    return folders


def points(
    series: str, folders: SubjectFolders, scene: Scene, sections: Iterable[tuple[int, dict[str, Any]]]
) -> list[Point]:
    """One asset for each (crf, section of compress)."""
    meshes = read_meshes(folders.meshes / "meshes.npz")
    windows = read_windows(folders.samples / "grids.npz")
    textures = FrameStore(folders.textures / "textures.arrow")
    centre = read_centre(folders.samples / "grids.npz")
    source = AssetSource(scene.subject, scene.fps, scene.from_capture.inverse(), centre)
    found = []
    for crf, section in sections:
        params = CompressParams.model_validate(section)
        layers = crop_layers(meshes, windows, textures, scene.num_frames)
        mesh = resolved(params.mesh, layers, training_cameras(scene))
        target = folders.root / "asset"
        manifest = write_asset(target, meshes, windows, textures, source, params.model_copy(update={"mesh": mesh}))
        sizes = sum(layer.bytes for layer in manifest.full.layers), manifest.full.texture.videos[0].bytes
        found.append(Point(series, crf, *sizes, held_out_psnr(target, scene)))
        typer.echo(f"{series}, crf {crf}: {sizes[0]} + {sizes[1]} bytes, {found[-1].psnr:.3f} dB")
    return found


def held_out_psnr(asset_folder: Path, scene: Scene) -> float:
    """Mean over the held-out cameras and SCORED_FRAMES frames."""
    asset, truths, masks = read_asset(asset_folder), scene.open_frames(), scene.open_masks()
    frames = {round(float(k)) for k in np.linspace(0, scene.num_frames - 1, min(SCORED_FRAMES, scene.num_frames))}
    cameras = scene.indices("holdout")
    caster = AssetCaster(asset)
    hits = {index: caster.cast(scene.cameras[index]) for index in cameras}
    values = []
    for k, pictures in enumerate(asset.frames()):
        for index in cameras if k in frames else ():
            mask = masks.image(index, k)[..., 0] / 255 if masks is not None and (index, k) in masks else None
            values.append(psnr(shown(composite(hits[index], pictures)[0]), truths.image(index, k) / 255, mask))
    return float(np.mean([value for value in values if value is not None]))


def bytes_at(quality: float, series: list[Point]) -> float | None:
    """Bytes of a series at a quality, by linear interpolation of their logarithm; None where it does not reach it."""
    ordered = sorted(series, key=lambda point: point.psnr)
    if not ordered or not ordered[0].psnr <= quality <= ordered[-1].psnr:
        return None
    logs = np.log([point.bytes for point in ordered])
    return float(np.exp(np.interp(quality, [point.psnr for point in ordered], logs)))


def table(found: list[Point]) -> str:
    """Markdown: bytes of each series at the qualities of the paper's points."""
    names = list(dict.fromkeys(point.series for point in found))
    by_name = {name: [point for point in found if point.series == name] for name in names}
    lines = [f"| held-out PSNR | {' | '.join(names)} |", "|---" * (1 + len(names)) + "|"]
    for anchor in by_name[names[0]]:
        sizes = [bytes_at(anchor.psnr, by_name[name]) for name in names]
        best = min(point.bytes for point in found if point.psnr >= anchor.psnr)
        cells = [f"at most {best / 1000:.0f} kB" if size is None else f"{size / 1000:.0f} kB" for size in sizes]
        lines.append(f"| {anchor.psnr:.2f} dB | {' | '.join(cells)} |")
    return "\n".join(lines)


def draw(found: list[Point], path: Path, title: str) -> None:
    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.5))
    for name in dict.fromkeys(point.series for point in found):
        line = sorted((point.bytes / 1000, point.psnr) for point in found if point.series == name)
        axes.plot(*zip(*line, strict=True), "o-", label=name)
    axes.set(xscale="log", xlabel="kB, meshes and video", ylabel="PSNR on held-out cameras, dB", title=title)
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=120, bbox_inches="tight")
    pyplot.close(figure)


def main(
    subject: Annotated[Path, typer.Argument(help="Folder of a trained subject: config, scene, model.")],
    work: Annotated[Path, typer.Option(help="Folder for the exports; a second run uses them again.")],
    chart: Annotated[Path | None, typer.Option(help="Write a chart there (PNG).")] = None,
    codec: Annotated[list[str] | None, typer.Option(help="Codecs of ours (several: repeat).")] = None,
) -> None:
    """Compare the paper's export with ours: bytes against PSNR on held-out cameras, from one trained model."""
    with report_user_errors("rate_distortion"):
        scene = read_scene(subject / "scene")
        paper = exported(subject, work / "paper", PAPER)
        medium = {"codec": "h264", "preset": "medium"}
        found = points(
            "paper", paper, scene, ((f, {"mesh": LOSSLESS_MESH, "video": medium | {"crf": f}}) for f in FACTORS)
        )
        ours = exported(subject, work / "ours", {})
        for name in codec or ["h264", "vp9", "av1"]:
            sections = ((f, {"mesh": QUANTISED_MESH, "video": {"codec": name, "crf": f}}) for f in FACTORS)
            found += points(f"ours, {name}", ours, scene, sections)
        write_json(work / "rate.json", [asdict(point) | {"bytes": point.bytes} for point in found])
        typer.echo(f"\n{scene.subject}, {scene.num_frames} frames\n{table(found)}")
        if chart:
            draw(found, chart, f"{scene.subject}, {scene.num_frames} frames")


if __name__ == "__main__":
    typer.run(main)
