"""Memory and speed of `normalize` and `train` on a capture of Multiface's size: 60 frames, 24 cameras, 768 x 512.

Rendering such a film of the embedded actor takes an hour, so its default film is enlarged and played to and fro:
sizes, cameras and files are those of a large capture, the detail in its pictures is not. Scores mean nothing here and
are not given.
"""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import cv2
import numpy as np
import torch
import typer
from numpy.typing import NDArray
from tqdm import tqdm

from bench.processes import in_a_process
from facefolds_core.captures.actor.capture import krt_block
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.images import decode_image
from facefolds_core.captures.krt import read_krt
from facefolds_core.captures.multiface import read_multiface
from facefolds_core.captures.scene import read_scene
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import atomic_folder
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import ExplicitParams, NormalizeParams, Subject
from facefolds_core.training.explicit.loop import train_explicit
from facefolds_core.training.report import TrainingReport, peak_memory

SEGMENT = "PERFORMANCE"
GIB = 2**30


def to_and_fro(count: int, available: int) -> list[int]:
    """Frames 0, 1, ..., n - 1, n - 2, ..., 0, 1, ...: `count` of them."""
    there = list(range(available))
    cycle = there + there[-2:0:-1]
    return [cycle[k % len(cycle)] for k in range(count)]


def enlarged(camera: Camera, factor: int) -> Camera:
    """The same camera with `factor` times as many pixels each way."""
    K = camera.K.copy()
    K[:2] *= factor
    return Camera(camera.name, K, camera.w2c, camera.width * factor, camera.height * factor)


def enlarge(source: Path, target: Path, factor: int, frames: int) -> None:
    """Write a capture in Multiface's layout, like `source` but larger and longer; frames are numbered from 000001.

    Raises:
        UserError: if `source` is not a capture of the embedded actor.
    """
    names = sorted(path.stem for path in (source / "tracked_mesh" / SEGMENT).glob("*.bin"))
    if not names:
        raise UserError("no capture of the embedded actor", file=source, remedy="`dvc repro capture@actor` makes it")
    calibrations = read_krt(source / "KRT")
    order = [names[k] for k in to_and_fro(frames, len(names))]
    with atomic_folder(target) as folder:
        blocks = []
        for calibration in tqdm(calibrations, desc="enlarge", unit="camera"):
            pictures = source / "images" / SEGMENT / calibration.name
            images = {
                name: np.asarray(decode_image(pictures / f"{name}.png", calibration.name))[..., ::-1] for name in names
            }
            height, width = images[names[0]].shape[:2]
            K = calibration.K.copy()
            K[:2, 2] += 0.5
            blocks.append(krt_block(enlarged(Camera(calibration.name, K, calibration.w2c, width, height), factor)))
            _write_pictures(folder / "images" / SEGMENT / calibration.name, images, order, factor)
        (folder / "KRT").write_text("".join(blocks), encoding="utf-8")
        (folder / "frame_list.txt").write_text("".join(f"{SEGMENT} {k:06d}\n" for k in range(1, frames + 1)))
        meshes = folder / "tracked_mesh" / SEGMENT
        meshes.mkdir(parents=True)
        for k, name in enumerate(order, 1):
            for end in (".obj", ".bin", "_transform.txt"):
                shutil.copyfile(source / "tracked_mesh" / SEGMENT / f"{name}{end}", meshes / f"{k:06d}{end}")


def _write_pictures(folder: Path, images: dict[str, NDArray[np.uint8]], order: list[str], factor: int) -> None:
    """Each picture once, and links to it for the frames that repeat it."""
    folder.mkdir(parents=True)
    written: dict[str, Path] = {}
    for k, name in enumerate(order, 1):
        file = folder / f"{k:06d}.png"
        if name in written:
            file.hardlink_to(written[name])
            continue
        large = cv2.resize(images[name], None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
        if not cv2.imwrite(str(file), large, [cv2.IMWRITE_PNG_COMPRESSION, 1]):
            raise OSError(f"cannot write {file}")
        written[name] = file


def normalize(source: Path, scene: Path) -> tuple[float, float, int]:
    """Seconds of wall and processor, and peak memory in bytes, of writing the scene."""
    wall, processor = time.perf_counter(), time.process_time()
    subject = Subject(source="multiface", path=str(source))
    params = NormalizeParams(long_side=768, short_side=512)
    write_plan(plan_scene(read_multiface(source, subject), "large", subject, params, scene), params)
    return time.perf_counter() - wall, time.process_time() - processor, peak_memory(torch.device("cpu"))


def train(scene: Path, folder: Path) -> tuple[TrainingReport, float, float]:
    """The report of preset `fast`, processor seconds, and the part of its peak memory that it allocated, GiB."""
    processor = time.process_time()
    report = train_explicit(read_scene(scene), ExplicitParams(), folder / "model", folder / "log")
    return report, time.process_time() - processor, report.peak_memory_bytes / GIB


def main(
    source: Annotated[Path, typer.Argument(help="Capture of the embedded actor.")] = Path("data/actor/capture"),
    factor: Annotated[int, typer.Option(help="Times larger, each way.")] = 4,
    frames: Annotated[int, typer.Option(help="Of the large capture.")] = 60,
) -> None:
    """Enlarge the actor's film to Multiface's size; normalise and train; print seconds and peak memory."""
    with report_user_errors("bench"), TemporaryDirectory(prefix="facefolds-large-") as scratch:
        work = Path(scratch)
        enlarge(source, work / "capture", factor, frames)
        wall, processor, peak = in_a_process(normalize, work / "capture", work / "scene")
        size = (work / "scene" / "frames.arrow").stat().st_size
        typer.echo(
            f"bench: normalize: {wall:.0f} s ({processor:.0f} s of processor), peak memory {peak / GIB:.2f} GiB, "
            f"frames.arrow {size / GIB:.2f} GiB"
        )
        report, processor, gib = in_a_process(train, work / "scene", work)
        typer.echo(
            f"bench: train, fast: {report.seconds:.0f} s ({processor:.0f} s of processor), "
            f"{report.iterations} iterations, {report.rays_per_second:.0f} rays/s, "
            f"peak memory {gib:.2f} GiB (mapped pages of frames.arrow included)"
        )


if __name__ == "__main__":
    typer.run(main)
