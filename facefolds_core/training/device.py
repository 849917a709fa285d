"""The processor that `fast` trains on: CPUs, or an NVIDIA GPU through numba-cuda."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Literal

import torch

from facefolds_core.errors import UserError
from facefolds_core.training.report import device_name, peak_memory


@dataclass(frozen=True)
class Device:
    """Attributes:
    gpu: whether kernels run on a GPU.
    """

    gpu: bool

    @property
    def name(self) -> str:
        if not self.gpu:
            return device_name(torch.device("cpu"))
        from facefolds_core.kernels import gpu

        return gpu.name()

    def peak_memory(self) -> int:
        """Bytes in use on the GPU, or resident in this process, at most until now."""
        if not self.gpu:
            return peak_memory(torch.device("cpu"))
        from facefolds_core.kernels import gpu

        return gpu.most_bytes()


def choose(name: Literal["auto", "cpu", "cuda"]) -> Device:
    """ "auto" is the CPU: what a GPU makes has not been measured yet (`python -m bench.gpu`).

    Raises:
        UserError: if CUDA is asked for and there is none.
    """
    if name != "cuda":
        return Device(False)
    if importlib.util.find_spec("numba_cuda") is None:
        raise _none("numba-cuda, which is not installed", "pip install 'facefolds[cuda]'")
    from facefolds_core.kernels import gpu

    if not gpu.available():
        raise _none("an NVIDIA GPU and its driver", "see whether `nvidia-smi` shows one")
    return Device(True)


def _none(missing: str, remedy: str) -> UserError:
    return UserError(
        "no CUDA device",
        place="train.device",
        expected=missing,
        found="none",
        remedy=f"{remedy}, or set `device: cpu` in params.yaml",
    )
