"""At equal bytes: ours, one mesh with a video, and splats: `python -m bench.equal_bytes data/actor .equal_bytes`.

The mesh is what the pipeline makes with one layer. Splats are fitted to the same cut-outs, as many as our full level's
bytes hold: all for one still, or shared out among the frames, each fitted by itself. Held-out cameras, true opacity.

With `--page` a page instead, .equal_bytes/page: ours, the mesh and the still splats live, turned together.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from PIL import Image

from bench.players import build_pages
from bench.results import ROOT
from bench.run import Project, own_params
from bench.tables import markdown
from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.cutout import cut_from
from facefolds_core.captures.found_scene import found_scene
from facefolds_core.captures.scene import Scene
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.geometry.cameras import Camera
from facefolds_core.rendering.camera_paths import Eye, camera_of, turntable
from facefolds_core.rendering.pixels import render
from facefolds_core.scoring.backgrounds import Cutout, squared_error, worst_patch
from facefolds_core.scoring.images import cutout_of
from facefolds_core.scoring.metrics import decibels
from facefolds_core.scoring.truths import Truths
from facefolds_core.spacing import spread
from facefolds_core.subject import drawing
from facefolds_core.subject.fit import fit_pictures
from facefolds_core.subject.found import reference_frame
from facefolds_core.subject.gaussians import GaussianMethod
from facefolds_core.subject.ply import write_ply
from facefolds_core.subject.splats import Splats

SPLAT_BYTES = 20
"""Of SPZ with view dependence of the first degree: 28, of which gzip leaves 20.5. Scored are unrounded ones."""
FRAMES = 3
"""That are scored, evenly spread."""
PICTURES, SIZE, FIELD_OF_VIEW = 48, (200, 260), 18.5
"""Of the film, a turntable about the actor's middle in which all frames play; pixels of a pane; degrees."""
TARGET = (-0.1, 0.0, -0.035)
"""That middle, units."""
PAGE = """<!doctype html><meta charset="utf-8"><title>At equal bytes</title><link rel="icon" href="data:,">
<style>
body { margin: 0; font: 16px/1.4 system-ui, sans-serif; background: #808080; color: #fff }
main { display: grid; grid-template-columns: repeat(auto-fit, minmax(260px, 1fr)) }
figure { margin: 0; text-align: center }
figure > :first-child { display: block; width: 100%; aspect-ratio: 4 / 5 }
label { display: block; text-align: center; padding: 1rem }
input { width: min(24rem, 80%); vertical-align: middle }
</style>
<body><main></main><label>Turn <input type="range" min="-70" max="70" value="20"></label>
<script type="module" src="/beside.js"></script></body>
"""
STAGES = ("configure", "train", "sample", "reconstruct", "decimate", "texture", "bake", "compress")
Array = NDArray[np.float64]
Look = Callable[[Camera, int], tuple[Array, Array]]
"""(camera, frame) -> colours over black (H, W, 3) and opacity (H, W)."""


def one_layer(folders: SubjectFolders, out: Path) -> Asset:
    """The asset with one layer, of the same scene and subject; made once."""
    project = Project(out, "actor")
    if not (project.folders.asset / "manifest.json").exists():
        project.write(own_params("actor", {"train": {"layers": 1}}))
        for name in ("capture", "scene", "subject"):
            shutil.copytree(getattr(folders, name), getattr(project.folders, name), dirs_exist_ok=True)
        project.run(*STAGES)
    return read_asset(project.folders.asset)


def splats_of(scene: Scene, frame: int, count: int) -> Splats:
    """So many, of one frame's training pictures, cut out."""
    frames, mattes, plates = scene.open_frames(), scene.open_mattes(), scene.open_plates()
    assert mattes is not None and plates is not None
    cameras, pictures, opacities = [], [], []
    for index in scene.indices("train"):
        opacity = mattes.image(index, frame)[..., 0].astype(np.float32) / 255
        photo, plate = (
            store.image(*key) / np.float32(255) for store, key in ((frames, (index, frame)), (plates, (index, 0)))
        )
        cameras.append(scene.camera_in_head(index, frame))
        pictures.append(np.asarray(cut_from(photo, opacity, plate), np.float32))
        opacities.append(np.asarray(opacity, np.float32))
    return fit_pictures(cameras, pictures, replace(GaussianMethod(), fewest=count, most=count), 0, opacities)


def look_at_splats(scene: Scene, frames: list[int], count: int) -> Look:
    """One frame alone is a still: it is shown for every frame."""
    fitted = [splats_of(scene, frame, count) for frame in frames]
    return lambda camera, frame: _exact(*drawing.render(fitted[frame % len(fitted)], camera)[:2])


def _exact(rgb: NDArray[np.float32], alpha: NDArray[np.float32]) -> tuple[Array, Array]:
    return rgb.astype(np.float64), np.clip(alpha.astype(np.float64), 0, 1)


def truths(scene: Scene, frames: list[int]) -> dict[tuple[int, int], Cutout]:
    """Of the held-out cameras."""
    known, keys = Truths(scene), [(index, frame) for index in scene.indices("holdout") for frame in frames]
    return {key: found for key in keys if (found := cutout_of("true", known.at(*key))) is not None}


def scores(look: Look, scene: Scene, truth: dict[tuple[int, int], Cutout]) -> list[str]:
    """PSNR over any background and of the worst patch, dB."""
    errors, patches = [], []
    for (index, frame), one in truth.items():
        error = squared_error(*look(scene.camera_in_head(index, frame), frame), one)
        patch = worst_patch(error, one.opacity)
        errors.append(decibels(float(error.mean())))
        patches += [] if patch is None else [patch.psnr]
    return [f"{np.mean(errors):.1f}", f"{min(patches):.1f}"]


def film(looks: Sequence[Look], num_frames: int, count: int, size: tuple[int, int]) -> list[Image.Image]:
    """So many pictures: all of them side by side over grey, turning, while the frames play."""
    pictures = []
    for i, eye in enumerate(turntable(Eye(target=TARGET), count, (40, 40))):
        camera, shots = camera_of(eye, *size, FIELD_OF_VIEW), []
        for look in looks:
            rgb, alpha = look(camera, i % num_frames)
            shots.append(np.clip(rgb + (1 - alpha)[..., None] * 0.5, 0, 1))
        pictures.append(Image.fromarray(np.rint(255 * np.concatenate(shots, 1)).astype(np.uint8)))
    return pictures


def write_page(page: Path, ours: Asset, mesh: Asset, splats: Splats) -> None:
    """A folder for any static server: the players, what they show, and `beside.json`, which says it."""
    name = f"{len(splats):,} splats, a still, as SPZ"
    panes = [
        {"kind": "player", "name": "ours", "file": "ours/", "bytes": ours.full.entry.bytes},
        {"kind": "player", "name": "one mesh with a video", "file": "mesh/", "bytes": mesh.full.entry.bytes},
        {"kind": "splats", "name": name, "file": "splats.ply", "bytes": SPLAT_BYTES * len(splats)},
    ]
    with atomic_folder(page) as out:
        build_pages(out)
        for folder, asset in (("ours", ours), ("mesh", mesh)):
            shutil.copytree(asset.folder, out / folder)
        write_ply(out / "splats.ply", splats)
        write_json(out / "beside.json", {"panes": panes, "target": TARGET})
        (out / "index.html").write_text(PAGE, encoding="utf-8")


def main(
    subject: Annotated[Path, typer.Argument(help="Folder of the subject, e.g. data/actor: all stages have run.")],
    out: Annotated[Path, typer.Argument(help="Folder for the mesh's run, and for the page.")],
    page: Annotated[bool, typer.Option("--page", help="Make the page; no table and no film.")] = False,
) -> None:
    """Print the table, and film docs/images/equal_bytes.webp."""
    folders = SubjectFolders(subject)
    scene, ours, mesh = found_scene(folders), read_asset(folders.asset), one_layer(folders, out)
    every, size = list(range(scene.num_frames)), ours.full.entry.bytes
    if page:
        write_page(out / "page", ours, mesh, splats_of(scene, reference_frame(scene), size // SPLAT_BYTES))
        typer.echo(f"python -m http.server 8000 --directory {out / 'page'}")
        return
    frames = spread(every, FRAMES)
    still, each = size // SPLAT_BYTES, size // SPLAT_BYTES // scene.num_frames
    rows: dict[str, tuple[int, Look, list[int]]] = {
        f"ours, {ours.num_layers} layers": (size, lambda *view: _exact(*render(ours, *view)), frames),
        "one mesh with a video": (mesh.full.entry.bytes, lambda *view: _exact(*render(mesh, *view)), frames),
        f"{still:,} splats, a still": (still * SPLAT_BYTES, look_at_splats(scene, frames[:1], still), frames[:1]),
        f"{each:,} splats a frame": (
            scene.num_frames * each * SPLAT_BYTES,
            look_at_splats(scene, every, each),
            frames,
        ),
    }
    table = [
        [name, f"{count / 1000:.0f} KB", *scores(look, scene, truths(scene, seen))]
        for name, (count, look, seen) in rows.items()
    ]
    typer.echo(markdown(["", "bytes", "PSNR over any background, dB", "worst patch, dB"], table))
    first, *others = film([look for _, look, _ in rows.values()], len(every), PICTURES, SIZE)
    place = ROOT / "docs" / "images" / "equal_bytes.webp"
    first.save(place, "WEBP", save_all=True, append_images=others, duration=125, loop=0, quality=70, method=6)


if __name__ == "__main__":
    typer.run(main)
