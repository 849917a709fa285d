"""Frames of an earlier run that are made of the same as now: they are taken over instead of being made again."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore, Image
from facefolds_core.files.writing import atomic_folder, read_json, write_json

STORE, INDEX = "textures.arrow", "frames.json"


def digest_of(values: Mapping[str, Any]) -> bytes:
    """Of arrays, texts and numbers by name."""
    digest = hashlib.blake2b(digest_size=16)
    for name, value in sorted(values.items()):
        digest.update(name.encode())
        if isinstance(value, np.ndarray):
            digest.update(f"{value.dtype} {value.shape}".encode() + np.ascontiguousarray(value).tobytes())
        else:
            digest.update(repr(value).encode())
    return digest.digest()


class KeptFrames:
    """A layered frame store of an earlier run, and of what each of its frames was made.

    Args:
        folder: where they are kept; None keeps nothing.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self._known: dict[str, int] = {}
        self._made: dict[int, str] = {}
        self._store: FrameStore | None = None
        if folder is not None and (folder / INDEX).exists():
            with suppress(UserError, ValueError, TypeError, AttributeError):  # what is damaged is made again
                known = read_json(folder / INDEX)
                self._store = FrameStore(folder / STORE)
                self._known = {str(digest): int(frame) for digest, frame in known.items()}

    def groups(
        self,
        groups: Iterable[Sequence[int]],
        layers: Sequence[int],
        digest: Callable[[Sequence[int]], str],
        make: Callable[[Sequence[int], int], Iterable[Image]],
    ) -> Iterator[tuple[int, int, Image]]:
        """All images of frames that are made together, group by group, and in each layer by layer.

        Args:
            groups: frames of each.
            layers: N.
            digest: of what a group is made of; not asked for where nothing is kept.
            make: makes the images of a group's frames in one layer, (S, S, 4) each.
        """
        for frames in groups:
            names = [f"{digest(frames)} {k}" for k in range(len(frames))] if self.folder is not None else []
            self._made |= dict(zip(frames, names, strict=False))
            known = [self._known[name] for name in names if name in self._known]
            for layer in layers:
                images = self._layer(known, layer) if names and len(known) == len(names) else None
                for frame, image in zip(frames, make(frames, layer) if images is None else images, strict=True):
                    yield layer, frame, image

    def _layer(self, frames: Sequence[int], layer: int) -> Iterator[Image] | None:
        """A layer's images; None if one is missing or damaged."""
        assert self._store is not None
        store = self._store
        try:
            for frame in frames:
                store.image(layer, frame)
        except UserError:
            return None
        return (store.image(layer, frame) for frame in frames)

    def keep(self, store: Path) -> None:
        """Keep what `groups` gave instead, as it was written; the file is linked where that is possible."""
        if self.folder is None:
            return
        self._store = None
        with atomic_folder(self.folder) as temporary:
            try:
                os.link(store, temporary / STORE)
            except OSError:
                shutil.copyfile(store, temporary / STORE)
            write_json(temporary / INDEX, {digest: frame for frame, digest in self._made.items()})
