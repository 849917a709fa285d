"""What is known of a scored picture: the photo, the subject's opacity, the room without the subject."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.scoring.metrics import Array

MatteKind = Literal["true", "scene", "found"]
"""Where the subject is, for scores: in true masks that came with the capture; in mattes of the scene, the same for all
models; or where the model itself is opaque, for want of anything better."""


@dataclass(frozen=True)
class Truth:
    """One photo and what is known of it; colours and opacities in [0, 1].

    Attributes:
        picture: (H, W, 3).
        mask: (H, W) true opacity of the subject, or None.
        matte: (H, W) opacity that the scene has for training, or None.
        plate: (H, W, 3) the same camera's picture without the subject, or None.
    """

    picture: Array
    mask: Array | None = None
    matte: Array | None = None
    plate: Array | None = None


class Truths:
    """All photos of a scene that have been taken, read one at a time."""

    def __init__(self, scene: Scene) -> None:
        self._photos = scene.open_frames()
        self._masks, self._mattes, self._plates = scene.open_masks(), scene.open_mattes(), scene.open_plates()

    def __contains__(self, key: tuple[int, int]) -> bool:
        return key in self._photos

    def at(self, camera: int, frame: int) -> Truth:
        """Args: indices in the scene."""
        key = (camera, frame)
        mask, matte = (_opacity(store, key) for store in (self._masks, self._mattes))
        plate = _picture(self._plates, (camera, 0))
        return Truth(self._photos.image(*key) / 255.0, mask, matte, plate)

    def matte_kind(self, keys: Sequence[tuple[int, int]]) -> MatteKind:
        """Which opacity the scores of these (camera, frame) go by: one for all, so that no mean mixes two."""
        if self._masks is not None and any(key in self._masks for key in keys):
            return "true"
        if self._mattes is not None and all(key in self._mattes for key in keys):
            return "scene"
        return "found"


def _picture(store: FrameStore | None, key: tuple[int, int]) -> Array | None:
    return store.image(*key) / 255.0 if store is not None and key in store else None


def _opacity(store: FrameStore | None, key: tuple[int, int]) -> Array | None:
    found = _picture(store, key)
    return None if found is None else found[..., 0]
