"""Texels that keep still, but for changes that show: what a video codec spends its bits on is to be seen.

A model's texels tremble from frame to frame, most where they show least: half transparent, behind others, seen by few
pixels. For the colour and for the alpha of each texel, over the frames,

    1/2 W sum_k |x_k - y_k|^2 + price (how often x changes)

is made least. y are the model's codes (of 255); W says how much the texel shows (`add_weights`), the mean over the
training cameras, so that the first term bounds an error summed over the pixels of a picture.
What shows follows its frames; what does not stays constant, and what lies between moves in few steps. A change costs
the same however far it goes: a blink of one frame is dropped or kept whole, not halved.

A long take is held in overlapping windows. At once, a frame that is trained again would change a texel or two of all
others, and every video segment would have to be encoded again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from facefolds_core.config.source_code import digest_of_packages
from facefolds_core.export.hold_kernel import add_weights, hold
from facefolds_core.export.kept import KeptFrames, digest_of
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh
from facefolds_core.kernels.hit_codes import before, encode
from facefolds_core.progress import progress
from facefolds_core.rendering.raster import cast_mesh
from facefolds_core.spacing import spread

MIN_LIGHT = 0.001
"""Layers behind less transmittance are left out."""

LOOKED_AT = 6
"""Frames in which it is looked how much a texel shows, evenly spread; the greatest counts."""

WINDOW = 96
"""Longest run of frames that are held together. Longer takes are held in overlapping windows."""

MEMORY = 32 << 20
"""For a window's frames of one layer, bytes; larger ones go through a file."""


def shown_rays(
    cameras: Sequence[Camera], meshes: Sequence[TexturedMesh], opacity: NDArray[np.uint8]
) -> NDArray[np.uint16]:
    """(P, N, 2): where rays through pixel centres meet the layers (kernels/hit_codes.py); those that may show anything.

    Args:
        opacity: (N, R, R), no frame's alpha is larger.
    """
    some = opacity > 0
    some[:, :-1] |= some[:, 1:]  # any of the four texels around a place
    some[:, :, :-1] |= some[:, :, 1:]
    found = []
    for camera in progress(cameras, desc="rays", unit="camera"):
        codes = np.zeros((camera.height * camera.width, len(meshes), 2), np.uint16)
        shows = np.zeros(len(codes), bool)
        for layer, mesh in enumerate(meshes):
            hit, st = cast_mesh(camera, mesh)
            own = np.flatnonzero(hit)
            codes[own, layer] = encode(st[hit])
            column, row = before(codes[own, layer], opacity.shape[1]).T
            shows[own] |= some[layer, row, column]
        found.append(codes[shows])
    return np.concatenate(found)


def texel_weights(codes: NDArray[np.uint16], textures: FrameStore, cameras: int) -> NDArray[np.float32]:
    """(N, S, S, 2): W of colour and of alpha.

    Args:
        codes: (P, N, 2) of `shown_rays`.
        textures: layered frame store.
        cameras: how many those are.
    """
    layers, frames = (sorted({key[i] for key in textures.keys()}) for i in (0, 1))  # noqa: SIM118
    weights = np.zeros((len(layers), textures.height, textures.width, 2), np.float32)
    for frame in spread(frames, LOOKED_AT):
        sums = np.zeros_like(weights)
        images = np.stack([textures.image(n, frame) for n in layers]).astype(np.float32)
        add_weights(codes, images, sums, MIN_LIGHT)
        np.maximum(weights, sums / np.float32(cameras), out=weights)
    return weights


def parts(count: int, window: int) -> list[tuple[range, range]]:
    """How a take of `count` frames is held: each frame in one part, and the frames around it that are held with it.

    A take of at most `window` frames is one part. Else a part is half a window, with a quarter before and after: what
    changes in a frame changes what is held of the frames near it, not of all.
    """
    if count <= window:
        return [(range(count), range(count))]
    step, margin = max(1, window // 2), window // 4
    own = [range(first, min(first + step, count)) for first in range(0, count, step)]
    return [(part, range(max(0, part.start - margin), min(count, part.stop + margin))) for part in own]


def held_rows(
    textures: FrameStore,
    weights: NDArray[np.float32],
    price: float,
    folder: Path,
    kept: KeptFrames,
) -> Iterator[tuple[int, int, NDArray[np.uint8]]]:
    """All textures, held: part by part, and in each layer by layer.

    Args:
        folder: where all frames of one layer and window lie meanwhile, if `MEMORY` cannot hold them.
        kept: of an earlier run; parts that would be the same are taken over.

    Yields:
        (layer, frame, (S, S, 4) uint8).
    """
    layers, frames = (sorted({key[i] for key in textures.keys()}) for i in (0, 1))  # noqa: SIM118
    made = parts(len(frames), WINDOW)
    shown = {frames[own.start]: [frames[k] for k in around] for own, around in made}
    common = digest_of({"weights": weights, "price": price, "code": digest_of_packages("export")})

    @cache
    def digest_of_images(frame: int) -> bytes:
        return digest_of({str(layer): textures.image(layer, frame) for layer in layers})

    def digest(own: Sequence[int]) -> str:
        around = shown[own[0]]
        said = [around.index(own[0]), len(own), *map(digest_of_images, around)]
        return digest_of({"common": common, "frames": said}).hex()

    def make(own: Sequence[int], layer: int) -> Iterator[NDArray[np.uint8]]:
        around = shown[own[0]]
        first = around.index(own[0])
        held = _held_layer(textures, layer, around, weights[layer], price, folder)
        yield from (image for position, image in enumerate(held) if first <= position < first + len(own))

    rows = kept.groups([[frames[k] for k in own] for own, _ in made], layers, digest, make)
    yield from progress(rows, total=len(frames) * len(layers), desc="hold", unit="texture")


def _held_layer(
    textures: FrameStore,
    layer: int,
    frames: Sequence[int],
    weights: NDArray[np.float32],
    price: float,
    folder: Path,
) -> Iterator[NDArray[np.uint8]]:
    """Some frames of a layer, held together."""
    shape = (len(frames), textures.height, textures.width, 4)
    rows = max(1, min(textures.height, MEMORY // (len(frames) * textures.width * 4)))
    with TemporaryDirectory(dir=folder, prefix=".hold-") as scratch:
        images = (
            np.empty(shape, np.uint8)
            if rows == textures.height
            else np.memmap(Path(scratch) / "layer", np.uint8, "w+", shape=shape)
        )
        for position, frame in enumerate(frames):
            images[position] = textures.image(layer, frame)
        for top in range(0, textures.height, rows):
            block = np.ascontiguousarray(images[:, top : top + rows])
            hold(block, np.ascontiguousarray(weights[top : top + rows]), price)
            images[:, top : top + rows] = block
        yield from images
