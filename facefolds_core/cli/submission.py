"""Films of an asset for the hidden cameras of the NeRSemble NVS benchmark: `facefolds submission ...`.

    OUT.zip
    388/GLASSES/cam_222200037.mp4  cam_222200039.mp4  cam_222200046.mp4

Each is H.264 of 1100 x 1604 pixels with CRF 14, 73 pictures a second and the colours of FFmpeg's defaults, as
tobias-kirschstein/nersemble-benchmark writes them: README.md (4.1), src/nersemble_benchmark/data/submission_data.py
(`NVSSubmissionDataWriter`) and constants.py (the hidden cameras).
"""

from __future__ import annotations

import re
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import av
import numpy as np
import typer
from numpy.typing import NDArray

from facefolds_core.asset import read_asset
from facefolds_core.captures.scene import read_scene
from facefolds_core.captures.sources.nersemble import cameras_of
from facefolds_core.cli.render import LARGEST_SIDE, parse_colour, parse_size, pick_level, shrink
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import atomic_file
from facefolds_core.progress import progress
from facefolds_core.rendering.opengl import OpenGLRenderer
from facefolds_core.rendering.opengl_reflection import Glossy
from facefolds_core.rendering.pixels import SIDE, finer

HIDDEN = ("222200046", "222200037", "222200039")
RATE = 73
CRF = "14"


def command(
    asset: Annotated[Path, typer.Argument(help="Folder of the asset: it holds manifest.json.")],
    capture: Annotated[Path, typer.Argument(help="The participant's folder, such as nvs/388, with calibration/.")],
    out: Annotated[Path, typer.Argument(help="The .zip to write; films of other sequences in it are kept.")],
    sequence: Annotated[str, typer.Option(help="Name of the sequence, such as GLASSES.")],
    scene: Annotated[
        Path | None, typer.Option(help="The scene's folder; the one beside the asset if left out.")
    ] = None,
    participant: Annotated[str | None, typer.Option(help="Number; the capture's folder if left out.")] = None,
    camera: Annotated[list[str] | None, typer.Option(help="Serial; the benchmark's three if left out.")] = None,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT in pixels.")] = "1100x1604",
    background: Annotated[str, typer.Option(help="Colour behind the subject, #rrggbb.")] = "#ffffff",
    samples: Annotated[int, typer.Option(help="A pixel is the mean of samples x samples rays.", min=1, max=4)] = SIDE,
    level: Annotated[str | None, typer.Option(help="Level of detail by name; the full one if left out.")] = None,
) -> None:
    """Film an asset from cameras of its capture's calibration that have no pictures, and pack the films."""
    with report_user_errors("submission"):
        width, height = parse_size(size, film=True)
        if samples * max(width, height) > LARGEST_SIDE:
            expected = f"at most {LARGEST_SIDE // samples} pixels a side with --samples {samples}"
            raise UserError("too large a picture", place="--size", expected=expected, found=size)
        number = participant if participant is not None else capture.resolve().name
        for what, text, pattern in (("participant", number, r"\d+"), ("sequence", sequence, r"[\w+-]+")):
            if not re.fullmatch(pattern, text):
                remedy = f"set --{what}"
                raise UserError(f"no {what} of the dataset", place=f"--{what}", found=text, remedy=remedy)
        if out.suffix.lower() != ".zip":
            raise UserError("not the name of an archive", file=out, remedy="name a file that ends in .zip")
        shown = pick_level(read_asset(asset), level)
        to_scene = read_scene(scene if scene is not None else asset.resolve().parent / "scene").from_capture
        colour = parse_colour(background)
        films = {}
        with OpenGLRenderer(shown, Glossy.of(shown)) as renderer, tempfile.TemporaryDirectory() as folder:
            for one in cameras_of(capture, camera or HIDDEN, (width, height)):
                larger = finer(one.transformed(to_scene), samples)
                bar = progress(range(shown.num_frames), desc=f"camera {one.name}", unit="picture")
                pictures = (shrink(renderer.render(larger, k, colour)[0], samples) for k in bar)
                film = Path(folder) / f"cam_{one.name}.mp4"
                write_film(film, pictures, (width, height))
                films[f"{int(number):03d}/{sequence}/{film.name}"] = film
            pack(out, films)
        typer.echo(f"submission: {len(films)} films of {shown.num_frames} pictures in {out}")


def write_film(path: Path, pictures: Iterable[NDArray[np.uint8]], size: tuple[int, int]) -> None:
    """As the benchmark's own writer does.

    Args:
        pictures: (height, width, 3) RGB.
        size: (width, height).
    """
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=RATE, options={"crf": CRF})
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())


def pack(out: Path, films: dict[str, Path]) -> None:
    """Put files into an archive by name, whole or not at all; what else is in it stays.

    Raises:
        UserError: if there is a file of that name, but no archive.
    """
    with atomic_file(out) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        if out.exists():
            try:
                with zipfile.ZipFile(out) as old:
                    for member in old.infolist():
                        if member.filename not in films:
                            archive.writestr(member, old.read(member))
            except (zipfile.BadZipFile, OSError, EOFError) as error:
                remedy = "move it away, or name another file"
                raise UserError("not a zip archive", file=out, found=str(error), remedy=remedy) from None
        for name, film in films.items():
            archive.write(film, name)
