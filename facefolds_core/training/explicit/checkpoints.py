"""Checkpoints of a training of the explicit model, from which it goes on to the same model, bit for bit.

A folder: `state.json` and, of all that is trained, values and moments as `NAME.npy`, written array by array without a
copy in memory. What a training starts from (volume, cameras, charts) is found anew, and is not in it; it is the same
for the same scene, parameters and code, which whoever names the folder sees to, and `state.json` has a digest of it.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from dvclive.live import Live
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.errors import is_disk_error
from facefolds_core.facts import read_fact
from facefolds_core.files.writing import atomic_folder
from facefolds_core.params import SegmentParams
from facefolds_core.training.explicit.attempt import Attempt
from facefolds_core.training.explicit.plan import Epochs, Level
from facefolds_core.training.explicit.reflection_maps import Maps
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.trainer import Trainer
from facefolds_core.training.log import log_metrics

STATE = "state.json"
GRIDS = ("colour", "layers", "frame_colour", "frame_alpha")


class Checkpoints:
    """Of one training.

    Args:
        folder: of the checkpoint; there is one at most.
        params: how often it is written.

    Attributes:
        before: seconds of the runs that were cut off.
    """

    def __init__(self, folder: Path, params: SegmentParams) -> None:
        self.folder, self.params = folder, params
        self.before, self._began, self._next = 0.0, time.perf_counter(), 0.0

    def follow(self, trainer: Trainer) -> None:
        """Write one from time to time."""
        self._wait(0.0)
        trainer.keep = self._keep

    def take_up(self, trainer: Trainer, levels: Sequence[Level], live: Live, bar: tqdm) -> Attempt | None:
        """Bring a training that has not begun to where the checkpoint was written, and its log; None if there is no
        checkpoint, or none of this training: it then begins at its beginning."""
        try:
            about = json.loads((self.folder / STATE).read_text(encoding="utf-8"))
            if about["start"] != _digest(trainer):
                return None
            at = self._read(trainer, levels, about)
        except (OSError, ValueError, LookupError, TypeError):  # none, damaged, or of another version
            return None
        for iteration, psnr, rows in trainer.logged:
            log_metrics(live, iteration, {"psnr": psnr, "texel_rows": rows})
        bar.update(trainer.iteration)
        bar.write(f"train: goes on from step {at.step} of {levels[at.level].iterations} of level {at.level + 1}")
        return at

    def _wait(self, took: float) -> None:
        """Until the next one, after one that took so many seconds."""
        self._next = time.perf_counter() + max(
            self.params.checkpoint_seconds, took * (1 / self.params.checkpoint_share - 1)
        )

    def _keep(self, trainer: Trainer, at: Attempt) -> None:
        start = time.perf_counter()
        if start < self._next:
            return
        try:
            self._write(trainer, at)
        except OSError as error:  # the one before stays
            if not is_disk_error(error):
                raise
            sys.stderr.write(f"\ntrain: no checkpoint: {error.strerror} ({error.filename})\n")
        self._wait(time.perf_counter() - start)

    def _write(self, trainer: Trainer, at: Attempt) -> None:
        assert trainer.state is not None
        about = {
            "start": _digest(trainer),
            "seconds": self.before + time.perf_counter() - self._began,
            "attempt": [at.level, at.tries, at.step, at.best, at.recent, at.epochs.left],
            "counts": [trainer.iteration, trainer.rays],
            "rate": trainer.rate,
            "psnr": trainer.psnr,
            "logged": trainer.logged,
            "events": [event.to_json() for event in trainer.events],
            "reflection": [trainer.gloss.on, trainer.gloss.smoother],
            "random": trainer.random.bit_generator.state,
        }
        with atomic_folder(self.folder) as temporary:
            for name, array in _arrays(trainer, trainer.state, at).items():
                np.save(temporary / f"{name}.npy", array)
            (temporary / STATE).write_text(json.dumps(about), encoding="utf-8")

    def _read(self, trainer: Trainer, levels: Sequence[Level], about: dict[str, Any]) -> Attempt:
        """Raises ValueError, LookupError or TypeError if it is damaged: the training has not been changed then."""
        level, tries, step, best, recent, left = about["attempt"]
        arrays = {path.stem: np.load(path, mmap_mode="r") for path in self.folder.glob("*.npy")}
        events = [read_fact(event) for event in about["events"]]
        logged = [(iteration, psnr, rows) for iteration, psnr, rows in about["logged"]]
        random = np.random.default_rng()
        random.bit_generator.state = about["random"]
        saved = [torch.from_numpy(np.array(arrays[f"saved{i}"])) for i in range(len(GRIDS))]
        grids = {name: arrays[name] for name in (*GRIDS, "steps")}
        middle, behind = torch.from_numpy(np.array(arrays["middle"])), np.array(arrays["behind"])
        lit = [f"reflection_{field.name}" for field in fields(Maps)]
        maps = Maps(*(np.array(arrays[name]) for name in lit)) if lit[0] in arrays else None
        shine, (on, smoother) = np.array(arrays["shine"]), about["reflection"]
        trainer.iteration, trainer.rays = about["counts"]
        trainer.rate, trainer.psnr = about["rate"], about["psnr"]
        trainer.logged, trainer.events, trainer.random, trainer.middle = logged, events, random, middle
        trainer.pictures.behind = behind
        state = trainer.take_up(levels[level])
        trainer.gloss.on, trainer.gloss.smoother, trainer.gloss.maps, state.shine = on, smoother, maps, shine
        for name, values in grids.items():
            torch.as_tensor(getattr(state, name)).numpy()[:] = values
        self.before = float(about["seconds"])
        return Attempt(level, saved, Epochs(len(state.steps), random, left), tries, step, best, recent)


def _arrays(trainer: Trainer, state: TextureState, at: Attempt) -> dict[str, NDArray[Any]]:
    """As they are, no copies."""
    found = {name: getattr(state, name).numpy() for name in GRIDS}
    found |= {f"saved{i}": values.numpy() for i, values in enumerate(at.saved)}
    if trainer.gloss.maps is not None:
        found |= {f"reflection_{name}": values for name, values in vars(trainer.gloss.maps).items()}
    found |= {
        "shine": state.shine,
        "behind": trainer.pictures.behind,
        "middle": trainer.middle.numpy(),
        "steps": state.steps,
    }
    return found


def _digest(trainer: Trainer) -> str:
    """Of what the volume said: where the layers begin, and which cameras are used with which gains."""
    fit, digest = trainer.fit, hashlib.sha256()
    for array in (fit.middle, fit.halfwidth, fit.trust, fit.opacity, fit.rgb, trainer.cameras.gains):
        digest.update(np.ascontiguousarray(array).data)
    digest.update(repr((fit.window, fit.texels, trainer.cameras.scene.splits)).encode())
    return digest.hexdigest()
