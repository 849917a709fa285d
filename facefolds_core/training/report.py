"""What every trainer reports, and the device it runs on."""

from __future__ import annotations

import resource
from dataclasses import dataclass

import torch

from facefolds_core.errors import UserError


@dataclass(frozen=True)
class TrainingReport:
    """`training.json`.

    Attributes:
        seconds: of training (start included, over all runs that it took).
        iterations: Adam steps.
        device: "cpu (2 threads)" or the GPU's name.
        preset: name in params.yaml.
        rays_per_second: mean over `seconds`.
        peak_memory_bytes: resident (CPU) or allocated (CUDA) at most, in the last run.
        final_psnr: of the training rays over the last log interval, dB.
    """

    seconds: float
    iterations: int
    device: str
    preset: str
    rays_per_second: float
    peak_memory_bytes: int
    final_psnr: float


def pick_device(name: str) -> torch.device:
    """ "auto", "cpu" or "cuda" -> device.

    Raises:
        UserError: if CUDA is asked for and there is none.
    """
    if name == "cuda" and not torch.cuda.is_available():
        raise UserError(
            "no CUDA device",
            place="train.device",
            expected="a CUDA GPU that this build of torch can use",
            found="none",
            remedy="set `device: auto` or `device: cpu` in params.yaml, or install a CUDA build of torch",
        )
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    return torch.device(name)


def make_report(
    seconds: float, iterations: int, device: torch.device, preset: str, rays: int, psnr: float
) -> TrainingReport:
    """Args: `rays`: shaded in all iterations together; the others as in `TrainingReport`."""
    if device.type == "cuda":
        name, peak = torch.cuda.get_device_name(device), torch.cuda.max_memory_allocated(device)
    else:
        name = f"cpu ({torch.get_num_threads()} threads)"
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return TrainingReport(
        seconds=round(seconds, 1),
        iterations=iterations,
        device=name,
        preset=preset,
        rays_per_second=round(rays / max(seconds, 1e-9), 1),
        peak_memory_bytes=peak,
        final_psnr=round(psnr, 3),
    )
