"""One cell of the matrix: a training under a hazard, seen from clean held-out cameras; and the file of all cells."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zlib import crc32

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from bench.results import commit_name, read_entries
from bench.stress_film import Shots, held_out, shoot, training, write_shots
from bench.stress_hazards import HAZARDS, Hazard
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file, write_json
from facefolds_core.model import RadianceManifolds, load_model
from facefolds_core.params import ExplicitParams, TrainParams, merged, train_params
from facefolds_core.scoring.metrics import psnr, shown
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.training.explicit.loop import train_explicit
from facefolds_core.training.loop import train

RESULTS = Path("bench/results/stress.json")
VERSION = 1
CLEAN = Hazard("clean", "clean", (0, 0, 0), "-")

CUT: dict[str, dict[str, Any]] = {
    "fast": {
        "iterations": 240,
        # Less than half the iterations, a quarter of the rays.
        "volume": {
            "levels": [{"resolution": 40, "iterations": 50}, {"resolution": 64, "iterations": 50}],
            "rays": 4096,
        },
    },
    "paper": {
        "manifold_width": 64,
        "output_scale": 1.0,
        "lr_manifold": 1e-4,
        "texture_layers": 3,
        "texture_width": 64,
        "lr_texture": 4e-3,
        "search_samples": 16,
        "rays": 512,
        "iterations": 250,
        "decay_interval": 250,
    },
}
"""What is cut so that a cell takes some seconds of processor time. `paper` keeps its twelve layers, their spacing and
the start from a sphere; the rates are those of `quick`, whose networks are of this kind."""

Picture = NDArray[np.float64]


class Cell(BaseModel):
    """One training.

    Attributes:
        hazard, strength, preset, seed: which.
        views: held-out camera -> PSNR of the subject, dB, mean over frames; empty after a failure.
        flat: PSNR of a silhouette of the subject's true shape in one colour, dB: a model below it shows nothing.
        restarts: times that a level of training diverged and was begun again.
        failure: the first line of the error, or "".
        iterations: of training.
        seconds: processor time of training.
        date: UTC, ISO 8601.
        commit: see `bench.results.Conditions`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    hazard: str
    strength: float
    preset: str
    seed: int
    views: dict[str, float] = {}
    flat: float = 0.0
    restarts: int = 0
    failure: str = ""
    iterations: int = 0
    seconds: float = 0.0
    date: str = ""
    commit: str = ""

    @property
    def key(self) -> tuple[str, float, str, int]:
        return self.hazard, self.strength, self.preset, self.seed

    @property
    def inner(self) -> float | None:
        """Mean PSNR of the held-out cameras inside the rig, dB."""
        values = [v for name, v in self.views.items() if name.startswith("A")]
        return float(np.mean(values)) if values else None

    @property
    def converged(self) -> bool:
        """It ended without an error or a new start, and shows more than a flat silhouette would."""
        return not self.failure and not self.restarts and self.inner is not None and self.inner > self.flat


def read_cells(path: Path) -> list[Cell]:
    """All cells, in the order in which they were made.

    Raises:
        UserError: if the file is not one of these.
    """
    return read_entries(path, "cells", VERSION, Cell)


def keep_cell(path: Path, cell: Cell) -> None:
    """Add it, in place of the same one made before; the file is never half written."""
    cells = [c for c in read_cells(path) if c.key != cell.key]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_json(path, {"version": VERSION, "cells": [c.model_dump(mode="json") for c in [*cells, cell]]})


def plan_cells(hazards: Sequence[str], presets: Sequence[str], seeds: int) -> list[Cell]:
    """Blank cells, the most telling first: seed by seed, each seed's clean case before its hazards.

    Args:
        hazards: keys; empty is all.

    Raises:
        UserError: if there is no such hazard or preset.
    """
    known = [hazard.key for hazard in HAZARDS]
    for name, names in ((hazards, known), (presets, list(CUT))):
        if wrong := [word for word in name if word not in names]:
            raise UserError("no such row or preset", found=", ".join(wrong), expected=", ".join(names))
    chosen = [hazard for hazard in HAZARDS if not hazards or hazard.key in hazards]
    fields = [(CLEAN, 0.0), *((h, h.strengths[place]) for place in (1, 2, 0) for h in chosen)]
    return [
        Cell(hazard=hazard.key, strength=strength, preset=preset, seed=seed)
        for seed in range(seeds)
        for preset in presets
        for hazard, strength in fields
    ]


def run_cell(blank: Cell, cache: Path, pictures: Path) -> Cell:
    """Film, disturb, train, score; a failed training is a result.

    Args:
        cache: folder of films.
        pictures: folder of what the held-out cameras see, truth beside model, one PNG a cell.
    """
    hazard = next((h for h in HAZARDS if h.key == blank.hazard), CLEAN)
    shots, truth = disturbed(hazard, blank.strength, blank.seed, cache)
    values = {"preset": blank.preset, "seed": blank.seed, "device": "cpu", **CUT[blank.preset]}
    params = train_params(merged(values, hazard.train(train_params(values), blank.strength)))
    found: dict[str, Any] = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit_name(Path(__file__).parent),
    }
    with TemporaryDirectory() as folder:
        scene = write_shots(shots, Path(folder) / "scene")
        began = time.process_time()
        try:
            model, restarts = _train(scene, params, Path(folder))
        except UserError as error:
            return blank.model_copy(update={**found, "failure": str(error).splitlines()[0]})
        found |= {
            "seconds": round(time.process_time() - began, 2),
            "restarts": restarts,
            "iterations": params.iterations,
        }
        views, flat, seen = score_views(model, scene, truth)
    save_strip(strip_path(pictures, blank), seen)
    return blank.model_copy(update={**found, "views": views, "flat": flat})


def disturbed(hazard: Hazard, strength: float, seed: int, cache: Path) -> tuple[Shots, Shots]:
    """Training shots, and clean held-out shots in the same world."""
    random = np.random.default_rng([seed, crc32(hazard.key.encode())])
    start = random.bit_generator.state
    parts = []
    for film, choose in ((hazard.film(strength), training), (hazard.truth(strength), held_out)):
        random.bit_generator.state = start
        parts.append(hazard.world(choose(shoot(film, cache)), strength, random))
    return hazard.disturb(parts[0], strength, random), parts[1]


def _train(scene: Scene, params: TrainParams, folder: Path) -> tuple[RadianceManifolds, int]:
    """The model, and how often a level of training was begun again."""
    if isinstance(params, ExplicitParams):
        train_explicit(scene, params, folder / "model", folder / "log")
        events = json.loads((folder / "model" / "fit.json").read_text())["events"]
        restarts = sum("diverged" in event for event in events)
    else:
        train(scene, params, folder / "model", folder / "checkpoints", folder / "log")
        restarts = 0
    return load_model(folder / "model", torch.device("cpu")), restarts


def score_views(
    model: RadianceManifolds, scene: Scene, truth: Shots
) -> tuple[dict[str, float], float, list[tuple[Picture, Picture]]]:
    """PSNR of the subject for each held-out camera, mean over frames; that of a flat silhouette; pictures.

    Frames that the training did not have are shown between those that it had.

    Args:
        scene: of the training.
        truth: held-out cameras.

    Returns:
        camera -> dB; dB; (truth, model) of each camera's middle frame, (H, W, 3) over black.
    """
    times = np.interp(truth.scene.times, scene.times, np.arange(scene.num_frames))
    views, flats, pictures = {}, [], []
    for index, camera in enumerate(truth.scene.cameras):
        view, found = ModelView(model, camera), []
        for k, at in enumerate(times):
            wanted, mask = truth.images[index, k] / 255.0, truth.masks[index, k][..., 0] / 255.0
            picture = shown(view.render(float(at))[1])
            found.append(_dB(picture, wanted, mask))
            flat = (wanted * mask[..., None]).sum((0, 1)) / mask.sum()
            flats.append(_dB(np.broadcast_to(flat, wanted.shape), wanted, mask))
            if k == len(times) // 2:
                pictures.append((wanted * mask[..., None], picture))
        views[camera.name] = round(float(np.mean(found)), 4)
    inner = len(times) * sum(camera.name.startswith("A") for camera in truth.scene.cameras)
    return views, round(float(np.mean(flats[:inner])), 4), pictures


def _dB(picture: Picture, wanted: Picture, mask: Picture) -> float:  # noqa: N802
    value = psnr(picture, wanted, mask)
    assert value is not None
    return value


def strip_path(pictures: Path, cell: Cell) -> Path:
    """Where a cell's pictures lie."""
    return pictures / f"{cell.preset}_{cell.hazard}_{cell.strength:g}_{cell.seed}.png"


def save_strip(path: Path, seen: list[tuple[Picture, Picture]]) -> None:
    """One row of truths above one row of what the model shows."""
    rows = [np.concatenate([pair[i] for pair in seen], 1) for i in (0, 1)]
    with atomic_file(path) as temporary:
        cv2.imwrite(str(temporary), np.rint(255 * np.concatenate(rows)[..., ::-1]).astype(np.uint8))
