"""The device that models work on."""

from __future__ import annotations

import torch

from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams, MlpParams

CPU = torch.device("cpu")


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


def device_of(train: ExplicitParams | MlpParams) -> torch.device:
    """That a model is trained and looked at on: of `fast` the CPU, for which its kernels are compiled.

    Raises:
        UserError: as `pick_device`.
    """
    return CPU if train.model == "explicit" else pick_device(train.device)
