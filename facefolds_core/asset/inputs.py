"""Whether textures can be an asset's, before any of it is written."""

from __future__ import annotations

from functools import partial

from facefolds_core.errors import UserError
from facefolds_core.files.frame_store import FrameStore


def check_textures(textures: FrameStore, layers: int | None = None) -> int:
    """The number K of frames of a store that holds N x K square RGBA textures.

    Raises:
        UserError: if it does not; where `layers` is None, of any number of them.
    """
    wrong = partial(UserError, file=textures.path, remedy="run `dvc repro` to make the textures again")
    if textures.channels != 4 or textures.height != textures.width:
        found = f"{textures.height} x {textures.width} x {textures.channels}"
        raise wrong("the textures are not square RGBA images", found=found)
    keys = textures.keys()
    frames = 1 + max((frame for _, frame in keys), default=-1)
    layers = 1 + keys[-1][0] if layers is None and keys else layers or 1
    if frames == 0 or keys != [(layer, frame) for layer in range(layers) for frame in range(frames)]:
        expected = f"{layers} layers x {frames} frames"
        raise wrong("the texture store is not complete", expected=expected, found=f"{len(keys)} images")
    return frames
