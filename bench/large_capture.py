"""Memory and speed of `normalize` and `train` on a capture of Multiface's size: the actor in 60 frames of 768 x 512.

Rendering the film takes about an hour of two cores, once: DVC keeps it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bench.run import Project, own_params, training_of
from facefolds_core.errors import report_user_errors
from facefolds_core.files import read_json

GIB = 2**30


def main(
    frames: Annotated[int, typer.Option(help="Of the capture.")] = 60,
    height: Annotated[int, typer.Option(help="Of its pictures; they are two thirds as wide.")] = 768,
    work: Annotated[Path, typer.Option(help="Folder for the project.")] = Path("data/bench/large"),
) -> None:
    """Film the actor at Multiface's size; normalise and train anew; print seconds and peak memory."""
    with report_user_errors("large_capture"):
        project = Project(work, "actor")
        film = {"frames": frames, "height": height, "width": 2 * height // 3}
        project.write(own_params("actor", {"capture": film, "train": {"preset": "fast"}}))
        project.repro("normalize", force=True)
        size = (project.folders.scene / "frames.arrow").stat().st_size
        seconds = read_json(project.folders.timing("normalize"))["seconds"]
        typer.echo(f"normalize: {seconds:.0f} s, frames.arrow {size / GIB:.2f} GiB")
        project.repro("train", force=True)
        report = training_of(project.folders)
        typer.echo(
            f"train, fast: {report['seconds']:.0f} s ({report['processor_seconds']:.0f} s of processor), "
            f"{report['iterations']} iterations, {report['rays_per_second']:.0f} rays/s, "
            f"peak memory {report['peak_memory_bytes'] / GIB:.2f} GiB (mapped pages of frames.arrow included)"
        )


if __name__ == "__main__":
    typer.run(main)
