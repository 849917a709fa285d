"""The start representation: Gaussians of one frame of each capture, its pictures of left-out cameras, its mattes.

python -m bench.start FOLDER [--only "sparse; mugsy"] [--seen]

FOLDER keeps the scenes, the Gaussians and a sheet of each capture: photo, picture of all Gaussians, of the subject over
what stands behind, matte over green, what stands behind without the subject. Of the subject alone PSNR is told over the
clean plate or, without one, over the photo with the subject painted over from its border.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray
from PIL import Image

from bench.gate import params_of, there
from bench.results import ROOT
from bench.run import Project, chosen
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.errors import report_user_errors
from facefolds_core.scoring.matte import interior_and_band, matte_errors
from facefolds_core.scoring.metrics import psnr
from facefolds_core.subject.body import body_among
from facefolds_core.subject.drawing import render
from facefolds_core.subject.find import pictures_of
from facefolds_core.subject.fit import fit_pictures
from facefolds_core.subject.found import background
from facefolds_core.subject.gaussians import GaussianMethod
from facefolds_core.subject.mattes import Mattes
from facefolds_core.subject.ply import write_ply
from facefolds_core.subject.splats import Splats

Array = NDArray[np.float64]

CAPTURES = ("actor", "clutter", "mugsy", "studio", "sparse", "buddha", "fox")
"""The first two are the actor of params.yaml."""
SHOWN = 3
"""Cameras on a sheet."""


def scene_of(name: str, folder: Path, captures: Path) -> Scene:
    """A capture's scene, made once."""
    project = Project(folder / name, "actor")
    if not (project.folders.scene / "scene.json").exists():
        project.write(params_of(name, captures))
        project.run("configure", "capture", "normalize")
    return read_scene(project.folders.scene)


def over_plate(scene: Scene, index: int, subject: Splats) -> Array:
    """(H, W, 3) the subject alone over what stands behind it."""
    camera, plates, masks = scene.camera_in_head(index, 0), scene.open_plates(), scene.open_masks()
    if plates is not None and (index, 0) in plates:
        plate = plates.image(index, 0)
    else:
        hole = np.zeros((scene.height, scene.width), np.uint8)
        if masks is not None and (index, 0) in masks:
            there = (masks.image(index, 0)[..., 0] > 2).astype(np.uint8)
            hole = np.asarray(cv2.dilate(there, np.ones((3, 3), np.uint8)), np.uint8)
        plate = np.asarray(cv2.inpaint(scene.open_frames().image(index, 0).copy(), hole, 3, cv2.INPAINT_TELEA))
    rgb, alpha, _ = render(subject, camera)
    light = 1 - alpha[..., None]
    return np.asarray(np.clip(rgb - light * subject.background + light * (plate / 255.0), 0, 1))


def measure(name: str, scene: Scene, seen: bool, sheet: Path) -> str:
    """Fit, score, draw the sheet; one line of Markdown's table."""
    cameras, pictures = pictures_of(scene, 0, [*scene.indices("train"), *(scene.indices("holdout") if seen else [])])
    begun = time.perf_counter(), time.process_time()
    splats = fit_pictures(cameras, pictures, GaussianMethod())
    fitted = time.perf_counter() - begun[0], time.process_time() - begun[1]
    write_ply(sheet.with_suffix(".ply"), splats)
    body = body_among(scene, splats, 0)
    subject = body.subject
    held = [i for i in scene.indices("holdout") if (i, 0) in scene.open_frames()]
    finder, masks, rows, tiles = Mattes(scene, body=body), scene.open_masks(), list[list[float]](), []
    mattes = {index: finder.of((index, 0)).opacity for index in held}
    for index in held:
        truth, camera = scene.open_frames().image(index, 0) / 255.0, scene.camera_in_head(index, 0)
        drawn = np.clip(render(splats, camera)[0], 0, 1).astype(np.float64)
        alone, row = over_plate(scene, index, splats.part(subject)), [psnr(drawn, truth) or np.nan]
        if masks is not None and (index, 0) in masks:
            mask = masks.image(index, 0)[..., 0] / 255.0
            inside, band = (one.astype(np.float64) for one in interior_and_band(mask))
            row += [psnr(drawn, truth, inside) or np.nan]
            row += [psnr(alone, truth, one) or np.nan for one in (mask, inside, band)]
            row += [matte_errors(mattes[index] / 255.0, mask)["matte_iou"]]
        rows.append(row + [np.nan] * (6 - len(row)))
        matte = mattes[index][..., None] / 255.0
        behind = np.clip(background(splats, subject, camera), 0, 1)
        over_green = truth * matte + np.array([0.3, 0.8, 0.3]) * (1 - matte)
        tiles.append(np.concatenate([truth, drawn, alone, over_green, behind], 1))
    Image.fromarray((255 * np.concatenate(tiles[:SHOWN])).astype(np.uint8)).save(sheet)
    means = np.nanmean(np.array(rows), 0) if rows else np.full(6, np.nan)
    values = [*(f"{value:.2f}" for value in means[:5]), f"{means[5]:.4f}", *(f"{value:.0f}" for value in fitted)]
    return f"| {name} | {len(cameras)} | {len(splats)} | {int(subject.sum())} | {' | '.join(values)} |"


@report_user_errors("start")
def main(
    folder: Annotated[Path, typer.Argument(help="Where scenes and sheets are kept.")],
    only: Annotated[str, typer.Option(help="Some captures, separated by semicolons; by default all.")] = "",
    captures: Annotated[Path, typer.Option(help="Folder of the captures.")] = ROOT / "../shared/captures",
    seen: Annotated[bool, typer.Option("--seen", help="Fit held-out pictures, too: for what mattes score.")] = False,
) -> None:
    """Print the figures of all captures that are there."""
    names = chosen(only, CAPTURES, "--only")
    typer.echo("| | cameras | Gaussians | subject's | all | all, inside | subject | inside | band | IoU | s | CPU s |")
    typer.echo("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name in names:
        if name in there(captures):
            scene = scene_of(name, folder, captures)
            typer.echo(measure(name, scene, seen, folder / f"{name}{'_seen' if seen else ''}.png"))


if __name__ == "__main__":
    typer.run(main)
