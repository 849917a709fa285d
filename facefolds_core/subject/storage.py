"""gaussians.npz: the subject as it was found; body.npz: it among Gaussians of a whole scene, where those were fitted to
find poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files.archives import read_npz
from facefolds_core.files.reading import remake
from facefolds_core.files.writing import atomic_file
from facefolds_core.geometry.torso import NUMBERS, Torso
from facefolds_core.subject.cameras import CameraFit
from facefolds_core.subject.splats import COLUMNS, Splats

BODY = "body.npz"
"""In the scene's folder."""
DAMAGED = "the subject's Gaussians are damaged"


@dataclass(frozen=True)
class FoundSubject:
    """The subject in one frame.

    Attributes:
        splats: of it alone, in the head's own frame.
        psnr: of their pictures over the training pictures with the subject cut out, dB.
        cameras: what single training cameras do differently.
        torso: what of it stays in the room while the head turns; None where nothing does.
    """

    splats: Splats
    psnr: float
    cameras: CameraFit
    torso: Torso | None = None


@dataclass(frozen=True)
class Body:
    """What is the subject among Gaussians of a whole scene.

    Attributes:
        splats: of everything, in the head's own frame.
        subject: (N,) whether one is the subject's.
        frame: of the pictures that they explain.
    """

    splats: Splats
    subject: NDArray[np.bool_]
    frame: int


def write_body(path: Path, body: Body) -> None:
    """Write the file, whole or not at all."""
    splats, frame = body.splats, np.array([body.frame])
    with atomic_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, values=splats.values, behind=splats.background, subject=body.subject, frame=frame)


def read_body(path: Path, frames: int) -> Body:
    """Read it.

    Args:
        frames: of the scene.

    Raises:
        UserError: if it is damaged.
    """
    arrays = read_npz(path, DAMAGED)
    shapes = {"values": (None, COLUMNS), "behind": (3,), "subject": (None,), "frame": (1,)}
    _check(path, arrays, shapes, {"subject": "b", "frame": "i"})
    values, subject, frame = arrays["values"].astype(np.float32), arrays["subject"], int(arrays["frame"][0])
    if len(values) != len(subject) or not np.isfinite(values).all() or not 0 <= frame < frames:
        raise UserError(DAMAGED, file=path, expected="finite numbers, a frame of the scene", remedy=remake(path))
    return Body(Splats(values, arrays["behind"].astype(np.float32)), subject, frame)


def write_found(path: Path, found: FoundSubject) -> None:
    """Write the file, whole or not at all."""
    gains, errors, psnr = found.cameras.measured, found.cameras.errors, np.array([found.psnr])
    arrays = {"values": found.splats.values, "psnr": psnr, "gains": gains, "errors": errors}
    arrays |= {} if found.torso is None else {"torso": found.torso.numbers}
    with atomic_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def read_found(path: Path, cameras: int) -> FoundSubject:
    """Read it.

    Args:
        cameras: training cameras of the scene.

    Raises:
        UserError: if it is damaged, or of another number of cameras.
    """
    arrays = read_npz(path, DAMAGED)
    shapes = {"values": (None, COLUMNS), "psnr": (1,), "gains": (cameras, 3), "errors": (cameras,)}
    _check(path, arrays, shapes | ({"torso": (NUMBERS,)} if "torso" in arrays else {}), {})
    values = arrays["values"].astype(np.float32)
    if not len(values) or not np.isfinite(values).all() or not (arrays["gains"] > 0).all():
        raise UserError(DAMAGED, file=path, expected="finite numbers, gains above 0", remedy=remake(path))
    torso = Torso.of(arrays["torso"]) if "torso" in arrays else None
    if torso is not None and not torso.sound:
        raise UserError(DAMAGED, file=path, place="torso", found=str(torso), remedy=remake(path))
    fit = CameraFit(arrays["gains"].astype(np.float64), arrays["errors"].astype(np.float64))
    return FoundSubject(Splats(values, np.zeros(3, np.float32)), float(arrays["psnr"][0]), fit, torso)


def _check(
    path: Path,
    arrays: Mapping[str, NDArray[Any]],
    shapes: Mapping[str, tuple[int | None, ...]],
    kinds: Mapping[str, str],
) -> None:
    """Refuse what lacks an array, or has one of another shape or type; None is any length, types are float if not
    named."""
    for name, shape in shapes.items():
        array = arrays.get(name, np.zeros((0, 0, 0), np.complex64))
        fits = array.dtype.kind == kinds.get(name, "f") and array.ndim == len(shape)
        if not fits or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
            wanted, found = f"{name} of shape {shape}", f"{array.dtype} {array.shape}"
            raise UserError(DAMAGED, file=path, place=name, expected=wanted, found=found, remedy=remake(path))
