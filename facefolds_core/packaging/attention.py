"""Where a video's bits go: coarsely quantised is what hardly shows, finely what shows much.

An error e of a texel changes the pixels that see it by (dC/dx) e. With W = sum (dC/dx)^2 over the pixels of training
views, texels of equal W e^2 harm pictures alike, whatever they do to the picture of the atlas; and since e^2 grows with
the square of the quantiser's step, the step should be as 1 / sqrt(W): 3 log2 W steps of H.264's quantiser less, six of
which double it (Shoham and Gersho 1988: equal slopes). Rate and error are not that simple where little is coded, so
`strength` is a parameter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.packing import MACROBLOCK, AtlasLayout
from facefolds_core.asset.regions import QUANTISERS, Region
from facefolds_core.asset.writer import LevelContent
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import AttentionParams
from facefolds_core.rendering.compositing import transmittance_before
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import Hits, Texture
from facefolds_core.spacing import spread

MOST_SHOWN = 0.95
"""Quantile of what shows that is taken for what shows most: what a camera sees from very near is no measure."""

LEAST = 0.01
"""What shows less than this share of what shows most counts as that much: someone may look from where no camera
stood."""

CAMERAS = 24
"""Training cameras that are looked through, evenly spread."""

FRAMES = 3
"""Frames, evenly spread; the one counts in which a place shows most."""

RAYS_PER_CAMERA = 16_000
"""Rays of each camera that hit anything, drawn once."""

Weights = NDArray[np.float64]
"""(rows, columns), mean W of the texels of each macroblock of the picture."""


def regions_of(content: LevelContent, cameras: Sequence[Camera], params: AttentionParams) -> Sequence[Region]:
    """The regions of a level's pictures; none without cameras, or where all is to be coded alike.

    Args:
        cameras: for training, in the head's own frame.
    """
    if params.strength == 0 or not cameras:
        return ()
    weights = block_weights(content, views_of(content, cameras), spread(range(content.frames), FRAMES))
    return tuple(merged(offsets(weights, params.strength)))


RayHits = tuple[Hits, float]
"""Where chosen rays of a camera hit the layers, and how many pixels that do stand for each."""


def views_of(content: LevelContent, cameras: Sequence[Camera]) -> list[RayHits]:
    chosen = spread(cameras, CAMERAS)
    meshes, rng, views = [layer.mesh for layer in content.layers], np.random.default_rng(0), []
    for camera in chosen:
        cast = cast_layers(camera, meshes)
        pixels = cast.choose(rng, RAYS_PER_CAMERA)
        views.append((cast.at(pixels), int(cast.hit.any(2).sum()) / max(1, len(pixels))))
    return views


def block_weights(content: LevelContent, views: Sequence[RayHits], frames: Sequence[int]) -> Weights:
    """W of each macroblock: the greatest over some frames, of the sum over the pixels of some views."""
    layout = content.layout
    blocks = np.zeros((layout.height // MACROBLOCK, layout.width // MACROBLOCK))
    for frame in frames:
        textures, picture = content.frame(frame), np.zeros((layout.height, layout.width))
        for hits, pixels_a_ray in views:
            _add_weights(picture, hits, pixels_a_ray, textures, layout)
        shape = (blocks.shape[0], MACROBLOCK, blocks.shape[1], MACROBLOCK)
        blocks = np.maximum(blocks, picture.reshape(shape).mean((1, 3)))
    return blocks


def _add_weights(
    picture: Weights, hits: Hits, pixels_a_ray: float, textures: Sequence[Texture], layout: AtlasLayout
) -> None:
    """Add one camera's (dC/dx)^2 to the texels nearest to its hits: colour's in its half, alpha's in the other."""
    hit = hits.hit.reshape(-1, len(textures))
    st = hits.st.reshape(*hit.shape, 2)
    places = np.zeros((*hit.shape, 2), np.intp)
    rgba = np.zeros((*hit.shape, 4))
    for n, texture in enumerate(textures):
        size = np.array(texture.shape[1::-1])
        places[:, n] = np.clip(st[:, n] * size, 0, size - 1)
        rgba[:, n] = texture[places[:, n, 1], places[:, n, 0]] / 255 * hit[:, n, None]
    through, alpha = transmittance_before(rgba[..., 3], 1), rgba[..., 3]
    behind = np.zeros((len(hit), 3))
    for n in reversed(range(len(textures))):
        shown = hit[:, n]
        x, y = (places[shown, n] + layout.rects[n][:2]).T
        by_alpha = ((through[:, n, None] * (rgba[:, n, :3] - behind)) ** 2).mean(-1)
        for (left, top, _, _), weight in (
            (layout.colour_rect, (through[:, n] * alpha[:, n]) ** 2),
            (layout.alpha_rect, by_alpha),
        ):
            np.add.at(picture, (y + top, x + left), pixels_a_ray * weight[shown])
        behind = alpha[:, n, None] * rgba[:, n, :3] + (1 - alpha[:, n, None]) * behind


def offsets(weights: Weights, strength: float) -> NDArray[np.int64]:
    """Steps of the quantiser for each macroblock, about none in the (geometric) mean of what shows."""
    if not (weights > 0).any():
        return np.zeros(weights.shape, np.int64)
    floor = LEAST * float(np.quantile(weights[weights > 0], MOST_SHOWN))
    logs = np.log2(np.maximum(weights, floor))
    steps = -strength * (logs - logs[weights > floor].mean())
    return np.asarray(np.clip(np.rint(steps), -QUANTISERS, QUANTISERS), np.int64)


def merged(steps: NDArray[np.int64]) -> list[Region]:
    """Few rectangles of equal offset that cover the macroblocks (rows, columns) whose offset is not 0."""
    found, open_runs = [], dict[tuple[int, int, int], int]()
    for row, line in enumerate([*steps, np.zeros(steps.shape[1], np.int64)]):
        runs = set(_runs(line))
        for run in [run for run in open_runs if run not in runs]:
            start, stop, offset = run
            top = open_runs.pop(run)
            x, y, width, height = (MACROBLOCK * side for side in (start, top, stop - start, row - top))
            found.append(Region(x, y, width, height, offset))
        for run in runs:
            open_runs.setdefault(run, row)
    return sorted(found, key=lambda region: (region.y, region.x))


def _runs(line: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """(start, stop, offset) of equal neighbours, without those of 0."""
    borders = [0, *(int(i) for i in np.flatnonzero(np.diff(line)) + 1), len(line)]
    for start, stop in pairwise(borders):
        if line[start]:
            yield start, stop, int(line[start])
