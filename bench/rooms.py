"""Captures in real rooms, few cameras, seeds: what issue 13 asks for, beside what was before it.

python -m bench.rooms FOLDER [--only "studio; fox"] [--write]

A room is a capture with some of its cameras, plates or mattes withheld, run through all stages. FOLDER keeps what was
measured, and a strip of each asset from -80 to 80 degrees over white, black and green.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from PIL import Image

from bench.results import ROOT, Found, Store, commit_name, machine_name, now
from bench.run import Project, own_params
from bench.tables import markdown, number, replace_between
from facefolds_core.asset import read_asset
from facefolds_core.captures.actor import make_rig
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import atomic_folder, read_json
from facefolds_core.params import STAGE_SECTIONS, CaptureParams
from facefolds_core.pictures import open_picture
from facefolds_core.rendering.strips import strip
from facefolds_core.spacing import spread

MARKS = ("<!-- rooms: written by bench/rooms.py -->", "<!-- end of rooms -->")
FIGURES = ("psnr_over_plate", "psnr_subject", "psnr_found", "psnr_interior", "psnr_band", "matte_iou")
COLOURS = ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.1, 0.7, 0.2))
TWO: dict[str, Any] = {"source": "multiface", "holdout": ["400013", "400060"], "pixel_centres": 0.5}
CLUTTER, FOUND = {"clutter": 1.0}, {"method": "auto", "train": "all"}


def aside(count: int) -> list[str]:
    """Names of the actor's cameras but the held-out ones and `count` others, spread by azimuth."""
    rig = [camera for camera in make_rig(CaptureParams()).cameras if camera.name not in ("A011", "A023")]
    rig.sort(key=lambda camera: float(np.arctan2(camera.centre[0], 1000 - camera.centre[2])))
    kept = spread(range(len(rig)), count)
    return [camera.name for k, camera in enumerate(rig) if k not in kept]


ROOMS: dict[str, tuple[str, dict[str, Any]]] = {
    "actor": ("", {"evaluate": {"fresh_views": 24}}),
    **{f"actor, seed {seed}": ("", {"train": {"seed": seed}}) for seed in (1, 2)},
    **dict.fromkeys(("studio", "studio, no plates"), ("studio", TWO)),
    "fox": ("fox", {"source": "transforms", "front": "0019", "holdout": {"every": 7}}),
    "mugsy": ("mugsy", TWO),
    **{f"actor, {count} cameras": ("", {"validate": aside(count)}) for count in (12, 8)},
    "plain room": ("", {"capture": {"plates": False}}),
    "clutter": ("", {"capture": {**CLUTTER, "plates": False}}),
    "clutter, plates": ("", {"capture": CLUTTER}),
    "clutter, mattes": ("", {"capture": {**CLUTTER, "plates": False, "mattes": True}}),
    "clutter, mattes found": ("", {"capture": {**CLUTTER, "plates": False}, "matte": FOUND}),
    "clutter, mattes of plates": ("", {"capture": CLUTTER, "matte": FOUND}),
}
"""Name -> folder in shared/captures ("" is the actor of params.yaml), the subject's keys."""
STRIPS = ("actor", "clutter", "actor, 8 cameras")  # rows of docs/images/rooms.jpg


def strip_of(folder: Path, room: str) -> Path:
    return folder / f"{room.replace(', ', '_').replace(' ', '-')}.jpg"


def run(name: str, folder: Path, captures: Path) -> Found:
    """Run the stages, draw the strip, keep the figures."""
    (capture, keys), project = ROOMS[name], Project(strip_of(folder, name).with_suffix(""), "actor")
    params = own_params("actor", {} if capture else keys)
    if capture:
        with atomic_folder(folder / f"{project.root.name}_capture") as place:
            for path in (captures / capture).resolve().iterdir():
                if path.name != "plates" or "no plates" not in name:
                    (place / path.name).symlink_to(path)
        params["subjects"] = {"actor": {**keys, "path": str(folder.resolve() / f"{project.root.name}_capture")}}
    project.write(params)
    project.run("configure", *STAGE_SECTIONS)
    asset, metrics = read_asset(project.folders.asset), read_json(project.folders.metrics)
    picture = Image.fromarray(strip(asset, range(-80, 81, 20), COLOURS, (130, 165), 20.0))
    picture.save(strip_of(folder, name))
    figures, fresh, cost = {n: metrics["asset"][n] for n in FIGURES}, metrics.get("fresh_views"), metrics["cost"]
    if fresh:
        figures |= {"fresh": fresh["asset"]["psnr_subject"], "far": fresh["bands"][-1]["psnr_subject"]["asset"]}
    size = cost["mesh_bytes"] + cost["texture_bytes"]
    return Found(room=name, figures=figures, bytes=size, commit=commit_name(), date=now())


def table(found: Mapping[str, Found]) -> str:
    """A row a room; the actor's has PSNR of the subject on fresh views, and on those beyond 60 degrees aside."""
    names = [*FIGURES, "fresh", "far"]
    rows = [[room, *(number(one.figures.get(n), 2 + (n == "matte_iou")) for n in names)] for room, one in found.items()]
    rows = [[*row, f"{one.bytes / 1000:.0f}", one.commit[:7]] for row, one in zip(rows, found.values(), strict=True)]
    return markdown(["", *names, "KB", "commit"], rows)


@report_user_errors("rooms")
def main(
    folder: Annotated[Path, typer.Argument(help="Where captures are filmed and trained; some GB.")],
    only: Annotated[str, typer.Option(help="Some rooms, separated by semicolons.")] = "; ".join(ROOMS),
    captures: Annotated[Path, typer.Option(help="Folder of studio, fox and mugsy.")] = ROOT / "../shared/captures",
    write: Annotated[bool, typer.Option("--write", help="Put the tables into bench/RESULTS.md.")] = False,
) -> None:
    """Measure what FOLDER/rooms.json does not have yet."""
    names = [name.strip() for name in only.split(";")]
    if unknown := set(names) - set(ROOMS):
        raise UserError("no such room", place="--only", found="; ".join(unknown), expected="; ".join(ROOMS))
    store = Store(folder / "rooms.json", "rooms", Found)
    drawn = set(names) - {one.room for one in store.read()}
    missing = [room for room in STRIPS if room not in drawn and not strip_of(folder, room).exists()]
    if write and missing:
        again = f'--only "{"; ".join(missing)}" draws it, once {store.path.name} does not have it any more'
        raise UserError("no strip for docs/images/rooms.jpg", file=strip_of(folder, missing[0]), remedy=again)
    for one in store.fill([Found(room=name) for name in names], lambda blank: run(blank.room, folder, captures)):
        typer.echo(f"{one.room}: {one.figures}")
    known = {one.room: one for one in store.read()}
    typer.echo(text := f"{now()[:10]}, {machine_name('cpu')}.\n\n{table({n: known[n] for n in ROOMS if n in known})}")
    if write:
        replace_between(ROOT / "bench" / "RESULTS.md", *MARKS, text)
        strips = [open_picture(strip_of(folder, room)) for room in STRIPS]
        Image.fromarray(np.vstack([np.asarray(one) for one in strips])).save(ROOT / "docs" / "images" / "rooms.jpg")


if __name__ == "__main__":
    typer.run(main)
