"""Checkpoints: everything that training needs to go on to the same result, in one safetensors file.

Tensors: `model.*` (parameters and buffers), `optimiser.<moment>.<parameter>` (Adam's), `generator` (state of the ray
draws). Metadata: iteration, seconds trained so far, and the fingerprint of configuration and scene.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.tensor_files import check_tensors, read_tensors, write_tensors
from facefolds_core.params import TrainParams

CHECKPOINT = "checkpoint.safetensors"
_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


@dataclass
class TrainingState:
    """What changes while training.

    Attributes:
        model, optimiser: being trained.
        generator: draws rays; on the CPU.
        iteration: steps done.
        seconds: spent on them, over all runs.
        psnr: last logged, dB.
    """

    model: RadianceManifolds
    optimiser: torch.optim.Optimizer
    generator: torch.Generator
    iteration: int = 0
    seconds: float = 0.0
    psnr: float = 0.0


def fingerprint(params: TrainParams, scene: Scene) -> str:
    """16 hex digits that name a configuration and the scene it is trained on.

    A digest of the section's dump and of the scene. What does not change the result is left out: the preset's name, the
    device, the checkpoint interval, how many processes there are. Of the frame store, its size and
    64 evenly spread blocks of 4 KiB are read.
    """
    digest = hashlib.sha256()
    values = params.model_dump(mode="json", exclude={"device", "checkpoint_seconds", "preset"})
    values.get("segments", {}).pop("processes", None)
    digest.update(json.dumps(values, sort_keys=True).encode())
    digest.update((scene.folder / "scene.json").read_bytes())
    surface = scene.folder / "surface.npz"
    digest.update(surface.read_bytes() if surface.exists() else b"")
    frames = scene.folder / "frames.arrow"
    size = frames.stat().st_size
    digest.update(str(size).encode())
    with frames.open("rb") as file:
        for block in range(64):
            file.seek(size * block // 64)
            digest.update(file.read(4096))
    return digest.hexdigest()[:16]


def _state_tensors(state: TrainingState) -> dict[str, Tensor]:
    """All tensors of `state` by their names in the file, as they are (no copies)."""
    tensors = {f"model.{name}": tensor for name, tensor in state.model.state_dict().items()}
    for name, parameter in state.model.named_parameters():
        for moment in _MOMENTS:
            tensors[f"optimiser.{moment}.{name}"] = state.optimiser.state[parameter][moment]
    tensors["generator"] = state.generator.get_state()
    return tensors


def save_checkpoint(state: TrainingState, fingerprint: str, folder: Path) -> Path:
    """Write `checkpoint.safetensors` into `folder`, whole or not at all; replaces the one before.

    Args:
        fingerprint: the run's `fingerprint`.
    """
    path = folder / CHECKPOINT
    numbers = {"iteration": state.iteration, "seconds": state.seconds, "psnr": state.psnr}
    write_tensors(
        path, _state_tensors(state), {"fingerprint": fingerprint} | {name: repr(x) for name, x in numbers.items()}
    )
    return path


def load_checkpoint(state: TrainingState, fingerprint: str, folder: Path) -> None:
    """Continue from the checkpoint in `folder`: `state` becomes what it was when `save_checkpoint` saw it.

    Raises:
        UserError: if it is damaged or belongs to another configuration.
    """
    path = folder / CHECKPOINT
    remedy = f"delete {path} to train from the start, or restore the configuration that it was made with"
    tensors, metadata = read_tensors(path, remedy)
    if metadata.get("fingerprint") != fingerprint:
        raise UserError(
            "a checkpoint of another configuration",
            file=path,
            expected=f"fingerprint {fingerprint}",
            found=f"fingerprint {metadata.get('fingerprint')}",
            remedy=remedy,
        )
    _fill_optimiser(state)
    check_tensors(tensors, _state_tensors(state), path, remedy)
    state.model.load_state_dict(
        {name.removeprefix("model."): t for name, t in tensors.items() if name.startswith("model.")}
    )
    with torch.no_grad():
        for name, parameter in state.model.named_parameters():
            for moment in _MOMENTS:
                state.optimiser.state[parameter][moment].copy_(tensors[f"optimiser.{moment}.{name}"])
    state.generator.set_state(tensors["generator"])
    state.iteration, state.seconds = int(metadata["iteration"]), float(metadata["seconds"])
    state.psnr = float(metadata["psnr"])


def _fill_optimiser(state: TrainingState) -> None:
    """Give Adam its (zero) moments before its first step."""
    for _, parameter in state.model.named_parameters():
        entry = state.optimiser.state[parameter]
        if not entry:
            entry["step"] = torch.zeros((), dtype=torch.float32)
            entry["exp_avg"] = torch.zeros_like(parameter)
            entry["exp_avg_sq"] = torch.zeros_like(parameter)
