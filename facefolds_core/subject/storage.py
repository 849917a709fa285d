"""gaussians.npz: the subject as it was found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from facefolds_core.archives import read_npz
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_file
from facefolds_core.reading import remake
from facefolds_core.subject.cameras import CameraFit
from facefolds_core.subject.splats import COLUMNS, Splats

DAMAGED = "the subject's Gaussians are damaged"


@dataclass(frozen=True)
class FoundSubject:
    """The subject in one frame.

    Attributes:
        splats: of it alone, in the head's own frame.
        psnr: of their pictures over the training pictures with the subject cut out, dB.
        cameras: what single training cameras do differently.
    """

    splats: Splats
    psnr: float
    cameras: CameraFit


def write_found(path: Path, found: FoundSubject) -> None:
    """Write the file, whole or not at all."""
    gains, errors, psnr = found.cameras.measured, found.cameras.errors, np.array([found.psnr])
    with atomic_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, values=found.splats.values, psnr=psnr, gains=gains, errors=errors)


def read_found(path: Path, cameras: int) -> FoundSubject:
    """Read it.

    Args:
        cameras: training cameras of the scene.

    Raises:
        UserError: if it is damaged, or of another number of cameras.
    """
    arrays = read_npz(path, DAMAGED)
    shapes = {"values": (None, COLUMNS), "psnr": (1,), "gains": (cameras, 3), "errors": (cameras,)}
    for name, shape in shapes.items():
        array = arrays.get(name, np.zeros(0, np.int64))
        fits = array.dtype.kind == "f" and array.ndim == len(shape)
        if not fits or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
            found = f"{array.dtype} {array.shape}"
            raise UserError(
                DAMAGED, file=path, place=name, expected=f"floats {shape}", found=found, remedy=remake(path)
            )
    values = arrays["values"].astype(np.float32)
    if not len(values) or not np.isfinite(values).all() or not (arrays["gains"] > 0).all():
        raise UserError(DAMAGED, file=path, expected="finite numbers, gains above 0", remedy=remake(path))
    fit = CameraFit(arrays["gains"].astype(np.float64), arrays["errors"].astype(np.float64))
    return FoundSubject(Splats(values, np.zeros(3, np.float32)), float(arrays["psnr"][0]), fit)
