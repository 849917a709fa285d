"""Tensors in safetensors files: written whole or not at all, checked when they are read."""

from __future__ import annotations

import errno
import os
import re
from functools import partial
from pathlib import Path

from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from facefolds_core.errors import UserError, disk_error, is_disk_error
from facefolds_core.files.reading import check_regular, no_memory
from facefolds_core.files.writing import atomic_file


def write_tensors(path: Path, tensors: dict[str, Tensor], metadata: dict[str, str]) -> None:
    """Write a safetensors file, whole or not at all.

    Raises:
        OSError: where the disk fails, as for every other file; safetensors has an error of its own for it.
    """
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    with atomic_file(path) as temporary:
        try:
            save_file(tensors, str(temporary), metadata=metadata)
        except SafetensorError as error:
            number = re.search(r"os error (\d+)", str(error))
            if number is None:
                raise
            code = int(number[1])
            raise OSError(code, os.strerror(code)) from None


def read_tensors(path: Path, remedy: str) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Tensors and metadata of a safetensors file, on the CPU.

    Raises:
        UserError: if the file is missing or damaged.
    """
    check_regular(path, remedy)
    try:
        with safe_open(str(path), "pt") as file:
            return {name: file.get_tensor(name) for name in file.keys()}, file.metadata() or {}  # noqa: SIM118
    except MemoryError:
        raise no_memory(path) from None
    except (SafetensorError, OSError, ValueError, OverflowError, RuntimeError) as error:
        if is_disk_error(error):
            raise (no_memory(path) if error.errno == errno.ENOMEM else disk_error(error, path)) from None
        raise UserError(
            "damaged file", file=path, expected="a whole safetensors file", found=str(error), remedy=remedy
        ) from None


def check_tensors(found: dict[str, Tensor], expected: dict[str, Tensor], path: Path, remedy: str) -> None:
    """Compare names, shapes and finiteness.

    Raises:
        UserError: at the first difference, naming the tensor.
    """
    wrong = partial(UserError, file=path, remedy=remedy)
    for name in sorted(set(found) ^ set(expected)):
        raise wrong(
            "the file does not belong to this configuration",
            place=name,
            expected="this tensor" if name in expected else "no such tensor",
            found="no such tensor" if name in expected else "this tensor",
        )
    for name, tensor in found.items():
        if tensor.shape != expected[name].shape:
            raise wrong(
                "the file does not belong to this configuration",
                place=name,
                expected=f"shape {tuple(expected[name].shape)}",
                found=f"shape {tuple(tensor.shape)}",
            )
        if tensor.is_floating_point() and not tensor.isfinite().all():
            raise wrong("numbers that are not finite", place=name)
