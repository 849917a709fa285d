"""Memory and time of every stage at the size of a studio's pictures, by a capture that is enlarged.

python -m bench.large CAPTURE FOLDER [--factor 4]

CAPTURE is a folder in Multiface's layout, as the actor's. Its pictures are enlarged; what memory and time depend on
(pixels, texels, rays) is that of a large capture, what can be seen in them is not. Parameters are the project's, but
for pictures that keep their size. Memory is counted as `bench.takes` does.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer
import yaml

from bench.results import ROOT
from bench.run import Project
from bench.tables import markdown
from bench.takes import Watched, watched
from facefolds_core.captures.gathering import Calibration
from facefolds_core.captures.sources.multiface import read_krt
from facefolds_core.errors import report_user_errors
from facefolds_core.files.writing import write_json, write_text
from facefolds_core.params import STAGE_SECTIONS, merged

PICTURES = ("images", "masks", "mattes", "plates")


def enlarged_krt(cameras: list[Calibration], factor: int) -> str:
    """KRT for pictures `factor` times as large; the first pixel's centre stays at 0: x' = factor (x + 1/2) - 1/2."""
    moved = np.array([[factor, 0, (factor - 1) / 2], [0, factor, (factor - 1) / 2], [0, 0, 1.0]])
    blocks = []
    for camera in cameras:
        rows = [*(moved @ camera.K), camera.coefficients, *camera.w2c]
        blocks.append("\n".join([camera.name, *(" ".join(f"{x:.10g}" for x in row) for row in rows)]))
    return "\n\n".join(blocks) + "\n"


def enlarge(source: Path, folder: Path, factor: int) -> None:
    """Write a capture whose pictures are `factor` times as large; what else it has is copied."""
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns(*PICTURES, "KRT"))
    write_text(folder / "KRT", enlarged_krt(read_krt(source / "KRT"), factor))
    for kind in PICTURES:
        for path in sorted((source / kind).rglob("*.png")):
            picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            assert picture is not None
            size = (picture.shape[1] * factor, picture.shape[0] * factor)
            new = folder / path.relative_to(source)
            new.parent.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(new), cv2.resize(picture, size, interpolation=cv2.INTER_CUBIC))


def table(found: dict[str, Watched]) -> str:
    """A row a stage."""
    figures = {stage: (one.memory / 1e6, one.processor, one.seconds) for stage, one in found.items()}
    rows = [[stage, *(f"{value:.0f}" for value in own)] for stage, own in figures.items()]
    return markdown(["stage", "MB", "s of processor", "s"], rows)


def main(
    capture: Annotated[Path, typer.Argument(help="A folder with KRT.")],
    folder: Annotated[Path, typer.Argument(help="Where it is enlarged, and the results go; some GB.")],
    factor: Annotated[int, typer.Option(help="By which pictures are enlarged, each way.")] = 4,
) -> None:
    """Measure every stage on large pictures."""
    with report_user_errors("large"):
        if not (folder / "capture").exists():
            enlarge(capture, folder / "capture", factor)
        project = Project(folder, "large")
        params: dict[str, Any] = yaml.safe_load((ROOT / "params.yaml").read_text(encoding="utf-8"))
        subject = {"source": "multiface", "path": "capture"}
        project.write(merged({**params, "subjects": {"large": subject}}, {"normalize": {"short_side": 768}}))
        project.run("configure", "capture")
        found = {}
        for stage in STAGE_SECTIONS[1:]:
            found[stage] = watched(project, stage)
            write_json(folder / "large.json", {name: vars(one) for name, one in found.items()})
            typer.echo(f"{stage}: {found[stage].seconds:.0f} s, {found[stage].memory / 1e6:.0f} MB")
        typer.echo(table(found))


if __name__ == "__main__":
    typer.run(main)
