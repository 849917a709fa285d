"""Where trainers fail: bad captures, wrong starts, other spacings and seeds, as what they cost on clean held-out views.

python -m bench.hazards                      # the actor's small film, a cut budget: docs/research/hazards.md, heat map
python -m bench.hazards --subject actor      # a prepared scene, each preset's whole budget

Every cell is a training of its own, kept in bench/results/hazards.json, failures too, and not measured again.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from functools import reduce
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any
from zlib import crc32

import numpy as np
import torch
import typer

from bench import charts
from bench.hazard_film import EXTREMES, Film, Shots, of_split, read_shots, shoot, write_shots
from bench.hazard_rows import CLEAN, FILM, HAZARDS, Hazard
from bench.results import Cell, Store, commit_name, mean, now
from bench.run import Project, own_params, score_model
from bench.tables import hazard_tables, replace_between
from facefolds_core.captures.scene import Scene, Split
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import read_json
from facefolds_core.scoring.metrics import psnr
from facefolds_core.scoring.perceptual import Perceptual

RESULTS = Path("bench/results/hazards.json")
CHART = Path("docs/images/hazards.png")
PAGE = Path("docs/research/hazards.md")
MARKERS = ("<!-- written by bench/hazards.py -->", "<!-- end of what bench/hazards.py writes -->")
SEEDS = {"fast": 3, "paper": 1}
"""Of the film, without --seeds: with these the matrix takes less than an hour on two idle cores."""
CUT: dict[str, dict[str, Any]] = {
    "fast": {"iterations": 240},
    "paper": {
        **{"manifold_width": 64, "output_scale": 1.0, "lr_manifold": 1e-4, "search_samples": 16, "rays": 512},
        **{"texture_layers": 3, "texture_width": 64, "lr_texture": 4e-3, "iterations": 250, "decay_interval": 250},
    },
}
"""What is cut of the film's trainings so that a cell takes some seconds. `paper` keeps its twelve layers, their spacing
and the start from a sphere; the rates are those of `quick`, whose networks are of this kind."""


def plan(subject: str, hazards: Sequence[str], presets: Sequence[str], seeds: int) -> list[Cell]:
    """Blank cells, the most telling first: seed by seed, each seed's clean case before its hazards.

    Args:
        hazards: keys; empty is all (that can be had from a prepared scene, if `subject` is one).
        seeds: 0 is the usual number.

    Raises:
        UserError: if there is no such hazard or preset.
    """
    known = [hazard for hazard in HAZARDS if subject == FILM or hazard.film is None]
    keys = [hazard.key for hazard in known]
    for names, there in ((hazards, keys), (presets, list(CUT))):
        if wrong := [name for name in names if name not in there]:
            raise UserError("no such row or preset", found=", ".join(wrong), expected=", ".join(there))
    chosen = [hazard for hazard in known if not hazards or hazard.key in hazards]
    fields = [(CLEAN, 0.0), *((h, h.strengths[place]) for place in (1, 2, 0) for h in chosen)]
    wanted = {preset: seeds or SEEDS[preset] for preset in presets}
    return [
        Cell(subject=subject, hazard=hazard.key, strength=strength, preset=preset, seed=seed)
        for seed in range(max(wanted.values()))
        for preset in presets
        if seed < wanted[preset]
        for hazard, strength in fields
    ]


def run_cell(blank: Cell, data: Path, cache: Path) -> Cell:
    """Disturb, train, score; a failed training is a result.

    Args:
        data: folder that holds one folder a subject.
        cache: of films.
    """
    hazard = next((h for h in HAZARDS if h.key == blank.hazard), CLEAN)
    source = None if blank.subject == FILM else read_shots(SubjectFolders(data / blank.subject).scene)
    shots, truth = disturbed(hazard, blank.strength, blank.seed, source, cache)
    found: dict[str, Any] = {"date": now(), "commit": commit_name()}
    with TemporaryDirectory() as folder:
        project = Project(Path(folder), "cell")
        scene = write_shots(shots, project.folders.scene)
        try:
            train(project, blank, hazard)
        except UserError as error:
            return blank.model_copy(update={**found, "failure": error.message})
        seen = write_shots(truth, Path(folder) / "truth")
        report = read_json(project.folders.model / "training.json")
        found |= {name: report[name] for name in ("iterations", "peak_memory_bytes")}
        found["seconds"] = report["processor_seconds"]
        return blank.model_copy(update=found | scored(project.folders.model, scene, seen))


def disturbed(hazard: Hazard, strength: float, seed: int, source: Shots | None, cache: Path) -> tuple[Shots, Shots]:
    """Training shots, and clean held-out shots in the same world. Without `source` they are filmed."""
    random = np.random.default_rng([seed, crc32(hazard.key.encode())])
    start = random.bit_generator.state
    parts = []
    wanted: tuple[tuple[Any, Split], ...] = (hazard.film, "train"), (hazard.truth, "holdout")
    for film, split in wanted:
        random.bit_generator.state = start
        shots = source or shoot(film(strength) if film else Film(), cache)
        parts.append(hazard.world(of_split(shots, split), strength, random))
    return hazard.disturb(parts[0], strength, random), parts[1]


def train(project: Project, blank: Cell, hazard: Hazard) -> None:
    """The stages `subject` and `train` on the project's scene, with the cell's values of the latter's section.

    Raises:
        UserError: if it fails.
    """
    values: dict[str, Any] = {"preset": blank.preset, "seed": blank.seed}
    values |= {"device": "cpu", **deepcopy(CUT[blank.preset])} if blank.subject == FILM else {}
    found = {"seed": blank.seed, **({"iterations": 600} if blank.subject == FILM else {})}
    subject = {"source": "actor", "path": "facefolds_core/captures/actor", "train": values}
    params = {**own_params("actor", {}), "subjects": {"cell": subject}, "subject": found}
    project.write(params)
    project.run("configure")
    usual = read_json(project.folders.config / "train.json")
    for model, key in hazard.scaled:
        *path, last = key.split(".")
        given = reduce(lambda section, name: section.get(name, {}), path, usual)
        if usual["model"] == model and last in given:
            place = reduce(lambda section, name: section.setdefault(name, {}), path, values)
            place[last] = blank.strength * given[last]
    project.write(params)
    project.run("configure", "subject", "train")


def scored(model: Path, scene: Scene, truth: Scene) -> dict[str, Any]:
    """Values of a cell: `psnr`, `views`, `flat`. Frames that the training lacked lie between those that it had."""
    times = dict(enumerate(np.interp(truth.times, scene.times, np.arange(scene.num_frames)).tolist()))
    values = list(score_model(model, truth, times, Perceptual(), torch.device("cpu")))
    key = "psnr_subject" if any(v["psnr_subject"] is not None for _, _, v in values) else "psnr"
    seen = dict.fromkeys(at for at, _, _ in values)
    views = {name: mean([v[key] for at, _, v in values if at == name]) for name in seen}
    inner = [name for name in views if name not in EXTREMES]
    return {"psnr": mean([views[name] for name in inner]), "views": views, "flat": flat(truth, inner)}


def flat(truth: Scene, names: Sequence[str]) -> float:
    """PSNR of the subject's true silhouette in its mean colour, dB, mean over cameras and frames; 0 without masks."""
    pictures, masks = truth.open_frames(), truth.open_masks()
    found: list[float | None] = []
    for index, k in masks or ():
        if masks and truth.cameras[index].name in names:
            wanted, mask = pictures.image(index, k) / 255.0, masks.image(index, k)[..., 0] / 255.0
            colour = (wanted * mask[..., None]).sum((0, 1)) / max(float(mask.sum()), 1e-9)
            found.append(psnr(np.broadcast_to(colour, wanted.shape), wanted, mask))
    return mean(found) or 0.0


def describe(cell: Cell) -> str:
    """One line for the terminal."""
    what = f"{cell.subject}, {cell.preset}, {cell.hazard} {cell.strength:g}, seed {cell.seed}"
    if cell.psnr is None:
        return f"{what}: failed: {cell.failure}"
    return f"{what}: {cell.psnr:.2f} dB after {cell.seconds:.1f} s" + ("" if cell.converged else ", not converged")


def main(
    subject: Annotated[str, typer.Option(help="`film`, or a subject with a prepared scene.")] = FILM,
    only: Annotated[str, typer.Option(help="Rows, comma-separated: the keys in bench/hazard_rows.py.")] = "",
    presets: Annotated[str, typer.Option(help="Comma-separated.")] = ",".join(CUT),
    seeds: Annotated[int, typer.Option(help="How many; 0 is 3 of fast and 1 of paper.")] = 0,
    draw_only: Annotated[bool, typer.Option("--draw-only", help="Only draw and print.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Measure again what is there.")] = False,
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    results: Annotated[Path, typer.Option(help="File that cells are added to.")] = RESULTS,
) -> None:
    """Measure the matrix, draw it, print its tables and write them into docs/research/hazards.md."""
    with report_user_errors("hazards"):
        store = Store(results, "cells", Cell)
        if not draw_only:
            blanks = plan(subject, [k for k in only.split(",") if k], presets.split(","), seeds)
            for cell in store.fill(blanks, lambda blank: run_cell(blank, data, data / "bench" / "films"), force):
                typer.echo(f"hazards: {describe(cell)}")
        text = hazard_tables(store.read())
        typer.echo(f"\n{text}")
        if results == RESULTS:
            replace_between(PAGE, *MARKERS, hazard_tables([cell for cell in store.read() if cell.preset == "fast"]))
            charts.hazards([cell for cell in store.read() if cell.subject == FILM], CHART)


if __name__ == "__main__":
    typer.run(main)
