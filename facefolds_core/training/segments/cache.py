"""Finished segments: files beside the model, named by what is in them, from which a later training takes up frames."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from facefolds_core.model.tensor_files import write_tensors

NAMES = ("frame_colour", "frame_alpha")


class SegmentCache:
    """The segments of one subject.

    Args:
        folder: of all their files.

    Attributes:
        frames: fingerprint of a frame -> its file, its place there, and its PSNR on training rays.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.frames: dict[str, tuple[Path, int, float]] = {}
        for path in sorted(folder.glob("segment-*.safetensors")):
            self.read(path)

    def read(self, path: Path) -> None:
        """Know a file that was written; what is damaged is made again."""
        with suppress(SafetensorError, OSError, ValueError, KeyError), safe_open(str(path), "pt") as file:
            for position, (frame, psnr) in enumerate(json.loads(file.metadata()["frames"])):
                self.frames.setdefault(frame, (path, position, float(psnr)))

    def path(self, frames: Sequence[str]) -> Path:
        """Of the segment of frames with these fingerprints."""
        name = hashlib.sha256("".join(frames).encode()).hexdigest()[:16]
        return self.folder / f"segment-{name}.safetensors"

    def has(self, frames: Sequence[str]) -> bool:
        """Whether the segment is there, whole."""
        path = self.path(frames)
        return path.exists() and all(frame in self.frames for frame in frames)

    def psnr(self, fingerprint: str) -> float:
        """Of a frame that is there, dB."""
        return self.frames[fingerprint][2]

    def frame(self, fingerprint: str) -> tuple[Tensor, Tensor, float] | None:
        """Colour, alpha and PSNR of a frame that is in any of the files."""
        found = self.frames.get(fingerprint)
        if found is None:
            return None
        path, position, psnr = found
        with safe_open(str(path), "pt") as file:
            colour, alpha = (file.get_slice(name)[position] for name in NAMES)
        return colour, alpha, psnr

    def write(self, frames: Sequence[str], fitted: Sequence[tuple[Tensor, Tensor, float]]) -> None:
        """Write a segment, whole or not at all."""
        path = self.path(frames)
        parts = [one[0] for one in fitted], [one[1] for one in fitted]
        tensors = {name: torch.stack(part) for name, part in zip(NAMES, parts, strict=True)}
        # One entry: safetensors writes several in any order, and equal segments are to be equal files.
        about = {"frames": json.dumps([[frame, one[2]] for frame, one in zip(frames, fitted, strict=True)])}
        write_tensors(path, tensors, about)
        self.read(path)

    def keep_only(self, paths: Sequence[Path]) -> None:
        """Delete all other segments, and what they were fitted against."""
        kept = {path.name for path in paths}
        for path in self.folder.glob("segment-*.safetensors"):
            if path.name not in kept:
                path.unlink()
