"""What every training gives, and how it is written."""

from __future__ import annotations

import resource
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import Spec, save_model
from facefolds_core.params import TrainParams

IMPORTED = time.process_time()
"""Processor time of this process until here."""


@dataclass(frozen=True)
class TrainingReport:
    """`training.json`.

    Attributes:
        seconds: of training (start included, over all runs that it took).
        processor_seconds: of all threads and worker processes, in the last run; imports left out.
        iterations: Adam steps.
        device: "cpu (2 threads)" or the GPU's name.
        preset: name in params.yaml.
        rays_per_second: mean over `seconds`.
        peak_memory_bytes: resident (CPU) or allocated (CUDA) at most, in the last run; the sum of all processes', with
            files that they share counted in each.
        final_psnr: of the training rays over the last log interval, dB.
    """

    seconds: float
    processor_seconds: float
    iterations: int
    device: str
    preset: str
    rays_per_second: float
    peak_memory_bytes: int
    final_psnr: float


def device_name(device: torch.device) -> str:
    """ "cpu (2 threads)" or the GPU's name."""
    return torch.cuda.get_device_name(device) if device.type == "cuda" else f"cpu ({torch.get_num_threads()} threads)"


def peak_memory(device: torch.device) -> int:
    """Bytes allocated on a GPU, or resident in this process, at most until now."""
    if device.type == "cuda":
        return torch.cuda.max_memory_allocated(device)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def make_report(
    seconds: float, iterations: int, device: str, memory: int, preset: str, rays: int, psnr: float
) -> TrainingReport:
    """Args: `rays`: shaded in all iterations together; `memory`: at most, bytes; the others as in `TrainingReport`."""
    return TrainingReport(
        seconds=round(seconds, 1),
        processor_seconds=round(time.process_time() - IMPORTED, 2),
        iterations=iterations,
        device=device,
        preset=preset,
        rays_per_second=round(rays / max(seconds, 1e-9), 1),
        peak_memory_bytes=memory,
        final_psnr=round(psnr, 3),
    )


@dataclass(frozen=True)
class Trained:
    """What a training gives.

    Attributes:
        model: what the export and the evaluation take.
        spec: what `model.json` says of it.
        report: seconds, iterations, PSNR on training rays.
        params: that ran (`params.json`), with the values of preset, subject and defaults filled in.
        fit: what was chosen and why (`fit.json`), of models that choose.
    """

    model: RadianceManifolds
    spec: Spec
    report: TrainingReport
    params: TrainParams
    fit: dict[str, Any] | None = None

    def save(self, folder: Path) -> None:
        """Write the model's folder, whole or not at all."""
        with atomic_folder(folder) as temporary:
            self.write(temporary)

    def write(self, folder: Path) -> None:
        """Write the model's files into a folder that is there."""
        save_model(self.model, self.spec, folder)
        write_json(folder / "training.json", asdict(self.report))
        write_json(folder / "params.json", self.params.model_dump(mode="json"))
        if self.fit is not None:
            write_json(folder / "fit.json", self.fit)
