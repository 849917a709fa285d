"""How one level of detail is coded: the section `compress` with the level's own values in it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from facefolds_core.asset.cropping import CroppedLayer
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CompressParams, LevelParams

MOST_BITS = 20

HIDDEN = 10.0
"""An error so many dB below the model's own is hardly seen by scores on photos it was not trained with: much of what it
takes is noise. 10 instead of 14 save half of the bytes of a capture with 25 dB, for 0.06 dB inside, and a third of
`sparse`'s (27 dB), for 0.05."""

LEAST_QUALITY = 36.0
"""But no target is lowered below this, dB: blocks would show, however bad the model is."""


def needed(params: CompressParams, explained: float | None) -> CompressParams:
    """With a `target_psnr` that is no higher than what the model explains of the photos asks for.

    Args:
        explained: PSNR of the uncoded export to the photos, dB; None where it is not known.
    """
    target = params.video.target_psnr
    if explained is None or target is None:
        return params
    target = min(target, max(LEAST_QUALITY, round(explained + HIDDEN, 1)))
    return params.model_copy(update={"video": params.video.model_copy(update={"target_psnr": target})})


def level_params(
    params: CompressParams, level: LevelParams | None = None, interval: int | None = None
) -> CompressParams:
    """Of the full level, or of a coarser one, which has a constant rate factor of its own.

    Args:
        interval: frames between the key frames of a stream, which has one a segment.
    """
    mesh, video = params.mesh, params.video
    if level is not None:
        video = video.model_copy(update={"crf": level.crf, "target_psnr": None})
        if level.max_error_pixels is not None:
            mesh = mesh.model_copy(update={"max_error_pixels": level.max_error_pixels})
    if interval is not None:
        video = video.model_copy(update={"keyframe_interval": interval})
    return params.model_copy(update={"mesh": mesh, "video": video})


def fitted(params: CompressParams, layers: Sequence[CroppedLayer], cameras: Sequence[Camera]) -> CompressParams:
    """With numbers of bits that keep `max_error_pixels` of the meshes; as it is where none is asked for."""
    error = params.mesh.max_error_pixels
    if error is None or not cameras:
        return params
    bits = {
        "quantization_bits": position_bits(layers, cameras, error),
        "texture_coordinate_bits": texture_coordinate_bits(layers, error),
    }
    return params.model_copy(update={"mesh": params.mesh.model_copy(update=bits)})


def position_bits(layers: Sequence[CroppedLayer], cameras: Sequence[Camera], pixels: float) -> int:
    """The fewest bits with which no vertex in front of a camera moves by more than `pixels` in its picture.

    A position moves by at most h = E / (2^b - 1) / 2 along each axis, E the longest side of the layer's box: by
    sqrt(3) h in space, and by f sqrt(3) h / z (1 + |x| / f) in the picture, f the focal length, z the depth and |x| the
    distance of the vertex' image from the principal point: the first term moves it across the axis, the second along.
    Vertices outside of the picture count like those at its corner.
    """
    worst = 0.0
    for layer in layers:
        vertices = layer.mesh.vertices.astype(np.float64)
        extent = float(np.ptp(vertices, axis=0).max())
        for camera in cameras:
            image, depth = camera.project(vertices)
            ahead = depth > 1e-6
            focal = float(max(camera.K[0, 0], camera.K[1, 1]))
            away = np.linalg.norm(image[ahead] - camera.K[:2, 2], axis=1)
            away = np.minimum(away, math.hypot(camera.width, camera.height))
            slopes = (focal + away) / depth[ahead]
            worst = max(worst, extent * float(slopes.max(initial=0)))
    return _bits(math.sqrt(3) * worst / 2, pixels)


def texture_coordinate_bits(layers: Sequence[CroppedLayer], texels: float) -> int:
    """The fewest bits with which no texture coordinate moves by more than `texels` along s or t."""
    worst = max(float(np.ptp(layer.mesh.st, axis=0).max()) * max(layer.crop[2:]) for layer in layers)
    return _bits(worst / 2, texels)


def _bits(range_: float, allowed: float) -> int:
    """The least b with range_ / (2^b - 1) <= allowed, at most `MOST_BITS`."""
    return min(MOST_BITS, max(1, math.ceil(math.log2(range_ / allowed + 1))))
