"""What each step of the export loses, for subjects that were exported with `dvc repro`.

python -m bench.export_waterfall --subjects actor     # data/actor/waterfall/waterfall.json, which the report shows
python -m bench.export_waterfall --chart              # all that have an asset; the chart and its figures
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from bench import charts
from facefolds_core.captures.scene import read_scene
from facefolds_core.errors import report_user_errors
from facefolds_core.files import atomic_folder, read_json, write_json
from facefolds_core.model import load_model
from facefolds_core.model.device import pick_device
from facefolds_core.packaging.views import spread
from facefolds_core.paths import SubjectFolders
from facefolds_core.scoring.waterfall import waterfall


def main(
    subjects: Annotated[str, typer.Option(help="Comma-separated names; by default all that have an asset.")] = "",
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    frames: Annotated[int, typer.Option(help="Frames that are rendered, evenly spread.")] = 3,
    chart: Annotated[bool, typer.Option("--chart", help="Draw them, and keep the figures in bench/results.")] = False,
) -> None:
    """Score every step of the export on the held-out cameras."""
    found: dict[str, list[dict[str, Any]]] = {}
    with report_user_errors("export_waterfall"):
        for subject in (
            subjects.split(",") if subjects else sorted(path.parent.name for path in data.glob("*/asset.glb"))
        ):
            folders = SubjectFolders(data / subject)
            scene = read_scene(folders.scene)
            model = load_model(folders.model, pick_device(read_json(folders.config / "train.json")["device"]))
            found[subject] = [asdict(s) for s in waterfall(scene, model, folders, spread(scene.num_frames, frames))]
            with atomic_folder(folders.root / "waterfall") as temporary:
                write_json(temporary / "waterfall.json", {"subject": subject, "steps": found[subject]})
            for step in found[subject]:
                size = step["mesh_bytes"] + step["texture_bytes"]
                typer.echo(f"{subject} {step['name']:10s} {step['psnr']:6.2f} dB {size:12d} bytes")
        if chart:
            charts.waterfall(found, Path("docs/images/export_waterfall.png"))
            rows = [{"subject": subject} | step for subject, steps in found.items() for step in steps]
            write_json(Path("bench/results/waterfall.json"), rows)


if __name__ == "__main__":
    typer.run(main)
