"""Explicit textures of a long take: what all frames share in memory, what single frames add in files, read frame by
frame.

A file `segments/00000.safetensors` holds some neighbouring frames: `frame_colour` (L, H, W, 3) and `frame_alpha`
(L, H, W, N), float16. Of colours at 0.5 its steps are 1/16 of a code of 255.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open
from torch import Tensor

from facefolds_core.errors import UserError
from facefolds_core.files.reading import check_regular
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.reflection import Reflection

FOLDER = "segments"
"""In a model's folder."""

KEPT = 3
"""Frames that are kept in memory: two between which one looks, and one more."""


def segment_file(folder: Path, number: int) -> Path:
    """Of a model's folder."""
    return folder / FOLDER / f"{number:05d}.safetensors"


class SegmentedTextures(GridTextures):
    """As `GridTextures`; `frame_colour` and `frame_alpha` are empty, frames come from `attach`ed files.

    Args:
        lengths: frames of each segment.
    """

    def __init__(
        self,
        window: Window,
        shape: tuple[int, int],
        num_layers: int,
        lengths: Sequence[int],
        reflection: Reflection | None = None,
    ) -> None:
        super().__init__(window, shape, num_layers, 0, reflection)
        self.places = [(number, k) for number, length in enumerate(lengths) for k in range(length)]
        self.lengths = tuple(lengths)
        self.paths: list[Path] = []
        self._files: list[Any] = []
        self._kept: dict[int, tuple[Tensor, Tensor]] = {}

    @property
    def num_frames(self) -> int:
        return len(self.places)

    def attach(self, paths: Sequence[Path], remedy: str) -> None:
        """Open the segments' files; numbers are read when they are asked for.

        Raises:
            UserError: if one is missing, damaged, or of another shape.
        """
        wanted = (*self.shape, 3), (*self.shape, self.layers.shape[2])
        self._files = []
        for path, length in zip(paths, self.lengths, strict=True):
            check_regular(path, remedy)
            expected = {"frame_colour": [length, *wanted[0]], "frame_alpha": [length, *wanted[1]]}
            try:
                file: Any = safe_open(str(path), "pt")
                found = {name: file.get_slice(name).get_shape() for name in file.keys()}  # noqa: SIM118
            except (SafetensorError, OSError, ValueError) as error:
                raise UserError("damaged file", file=path, found=str(error), remedy=remedy) from None
            if found != expected:
                raise UserError(
                    "the file does not belong to this model", file=path, expected=expected, found=found, remedy=remedy
                )
            self._files.append(file)
        self.paths, self._remedy = list(paths), remedy

    def frame(self, index: int) -> tuple[Tensor, Tensor]:
        found = self._kept.pop(index, None)
        if found is None:
            number, position = self.places[index]
            file = self._files[number]
            colour, alpha = (file.get_slice(name)[position].float() for name in ("frame_colour", "frame_alpha"))
            if not (colour.isfinite().all() and alpha.isfinite().all()):
                raise UserError("numbers that are not finite", file=self.paths[number], remedy=self._remedy)
            found = colour.to(self.colour.device), alpha.to(self.colour.device)
        self._kept[index] = found  # the last one asked for is the last to go
        while len(self._kept) > KEPT:
            self._kept.pop(next(iter(self._kept)))
        return found

    def segment(self, number: int) -> dict[str, Tensor]:
        """All numbers of one segment, as they are in its file (which may be gone from its folder by now)."""
        return {name: self._files[number].get_tensor(name) for name in ("frame_colour", "frame_alpha")}
