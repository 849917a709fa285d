"""`auto`: the least of several resolutions that the photos cannot tell from the best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.asset.packing import AtlasLayout
from facefolds_core.captures.scene import Scene, Split
from facefolds_core.export.stores import Grids
from facefolds_core.export.textures import resample
from facefolds_core.facts import Fact, fact
from facefolds_core.files.frame_store import FrameStore
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.meshes import TexturedMesh, layers_at
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.rendering.reference import Hits, composite
from facefolds_core.rendering.reflection import reflected_colours
from facefolds_core.spacing import spread

Texture = NDArray[np.uint8]

CAMERAS = 4
"""Cameras that are looked at, evenly spread: those for validation where there are any."""

FRAMES = 2
"""Frames of each camera, evenly spread."""

RAYS = 20_000
"""Pixels of each picture, at most, drawn at random."""

OPAQUE = 0.9
"""Pixels count where the finest candidate is at least so opaque."""

FIDELITY = 42.0
"""Least PSNR of a candidate's pictures to those of the finest one, dB."""

MESHES = (16, 24, 32, 48, 64)
"""R^m that are tried."""

LOSS = 0.08
"""Largest loss of PSNR against the photos of what is taken, to the best candidate's, dB. The codec adds its own."""

TEXELS = (128, 192, 256, 384, 512, 768)
"""R^t that are tried, below that of the samples, which is tried, too."""


Look = tuple[Camera, int]
"""A picture's camera, in the head's own frame, and frame."""


def looks_of(scene: Scene) -> tuple[Split, list[tuple[Look, NDArray[np.uint8]]]]:
    """Pictures (H, W, 3) of cameras and frames, evenly spread; those of cameras for validation, where there are any."""
    split: Split = "validate" if "validate" in scene.splits else "train"
    store = scene.open_frames()
    looks = []
    for camera in spread(scene.indices(split), CAMERAS, ends=False):
        seen = [k for k in range(scene.num_frames) if (camera, k) in store]
        for k in spread(seen, FRAMES, ends=False):
            looks.append(((scene.camera_in_head(camera, k), k), store.image(camera, k)))
    return split, looks


@dataclass(frozen=True)
class PhotoSample:
    """What a look shows through some meshes, at pixels drawn at random.

    Attributes:
        pixels: (M,).
        hits: at the pixels.
        images: textures of the look's frame, as they were sampled.
        photo: (M, 3) at the pixels, without what the reflection adds there, which textures do not show.
    """

    look: Look
    pixels: NDArray[np.intp]
    hits: Hits
    images: Sequence[Texture]
    photo: NDArray[np.float64]


def _seen(
    scene: Scene,
    meshes: Sequence[TexturedMesh],
    windows: Sequence[Window],
    reflection: ReflectionMaps | None,
    textures: FrameStore,
) -> tuple[Split, list[PhotoSample]]:
    """Of the cameras of the split by which things are chosen."""
    split, looks = looks_of(scene)
    rng, layers = np.random.default_rng(0), sorted({layer for layer, _ in textures})
    images = {k: [textures.image(layer, k) for layer in layers] for k in {k for (_, k), _ in looks}}
    found = []
    for look, image in looks:
        camera, k = look
        hits, own = _cast(scene, look, meshes), images[k]
        pixels = hits.choose(rng, RAYS)
        photo = image.reshape(-1, 3)[pixels] / 255.0
        if reflection is not None:
            to_room = None if scene.poses is None else scene.poses.at(k).rotation
            added = reflected_colours(hits, camera, windows, reflection, to_room)
            shine = composite(hits, own, added=added)[0] - composite(hits, own)[0]
            photo = photo - shine.reshape(-1, 3)[pixels]
        found.append(PhotoSample(look, pixels, hits.at(pixels), own, photo))
    return split, found


def _cast(scene: Scene, look: Look, meshes: Sequence[TexturedMesh]) -> Hits:
    camera, k = look
    return cast_layers(camera, layers_at(meshes, scene.poses, k))


PixelValues = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Colours (1, M, 3) and alpha (1, M) of chosen pixels."""


def _least(
    what: str,
    candidates: Sequence[int],
    pictures: Callable[[int], list[PixelValues]],
    split: Split,
    seen: Sequence[PhotoSample],
) -> tuple[int, Fact]:
    """From the finest down to the first that is not good enough: the one before it, and what was measured. The finest
    where no pixel counts.

    Args:
        pictures: of a candidate, one of each of `seen`, at its pixels.
    """
    finest, *coarser = sorted(candidates, reverse=True)
    best, photos = pictures(finest), [s.photo for s in seen]
    counts = [alpha[0] > OPAQUE for _, alpha in best]
    if not any(at.any() for at in counts):  # nothing says that less would do
        coarser = []

    def decibels(found: Sequence[PixelValues], truth: Sequence[NDArray[Any]]) -> float:
        parts = [(one[0][0] - other)[at] for one, other, at in zip(found, truth, counts, strict=True)]
        error = float(np.mean(np.concatenate(parts, dtype=np.float64) ** 2)) if sum(map(len, parts)) else 0.0
        return -10 * float(np.log10(max(error, 1e-10)))

    chosen, psnr, fidelity = finest, {finest: decibels(best, photos)}, {finest: 100.0}
    for c in coarser:
        found = pictures(c)
        psnr[c], fidelity[c] = decibels(found, photos), decibels(found, [rgb[0] for rgb, _ in best])
        if max(psnr.values()) - psnr[c] > LOSS or fidelity[c] < FIDELITY:
            break
        chosen = c
    return chosen, fact(
        "resolution_chosen",
        what=what,
        chosen=chosen,
        below=round(max(psnr.values()) - psnr[chosen], 3),
        to_finest=round(fidelity[chosen], 2),
        tried=sorted(psnr),
        psnr=[round(psnr[c], 3) for c in sorted(psnr)],
        fidelity=[round(fidelity[c], 2) for c in sorted(psnr)],
        views=len(seen),
        split=split,
    )


def _windows(grids: Grids) -> list[Window]:
    return [grids.window(i) for i in range(grids.num_layers)]


def explained(
    scene: Scene,
    meshes: Sequence[TexturedMesh],
    windows: Sequence[Window],
    reflection: ReflectionMaps | None,
    textures: FrameStore,
) -> float | None:
    """How well an export shows the photos where it is opaque, on the views that choices are made on, dB; None where
    nothing is opaque.

    Args:
        meshes, windows: of all layers, outermost first.
        textures: layered store, N layers x K frames of (R, R, 4).
    """
    errors = []
    for s in _seen(scene, meshes, windows, reflection, textures)[1]:
        rgb, alpha = composite(s.hits, s.images)
        errors.append(((rgb[0] - s.photo)[alpha[0] > OPAQUE]).astype(np.float64).ravel() ** 2)
    error = np.concatenate(errors)
    return -10 * float(np.log10(max(error.mean(), 1e-10))) if len(error) else None


def choose_meshes(
    scene: Scene,
    ladder: Mapping[int, Sequence[TexturedMesh]],
    grids: Grids,
    textures: FrameStore,
) -> tuple[int, Fact]:
    """R^m: the least of `MESHES` that is good enough, and why.

    Args:
        ladder: of each candidate the meshes of all layers.
        grids, textures: as they were sampled.
    """
    scene = scene.with_torso(grids.torso)
    split, seen = _seen(scene, ladder[max(MESHES)], _windows(grids), grids.reflection, textures)

    def pictures(candidate: int) -> list[PixelValues]:
        return [composite(_cast(scene, s.look, ladder[candidate]).at(s.pixels), s.images) for s in seen]

    return _least("decimate.resolution", MESHES, pictures, split, seen)


def choose_texels(scene: Scene, meshes: Sequence[TexturedMesh], grids: Grids, textures: FrameStore) -> tuple[int, Fact]:
    """R^t: the least of `TEXELS` that is good enough, and why; none is finer than the samples, all fit into a video.

    Args:
        meshes: of all layers.
        grids, textures: as they were sampled.
    """
    tried = sorted({c for c in TEXELS if c < textures.height} | {textures.height})
    candidates = [c for c in tried if AtlasLayout.pack([(c, c)] * len(meshes)).fits()] or tried[:1]
    scene = scene.with_torso(grids.torso)
    split, seen = _seen(scene, meshes, _windows(grids), grids.reflection, textures)
    images = {s.look[1]: s.images for s in seen}

    def pictures(candidate: int) -> list[PixelValues]:
        small = {k: [resample(image, candidate) for image in frame] for k, frame in images.items()}
        return [composite(s.hits, small[s.look[1]]) for s in seen]

    return _least("texture.resolution", candidates, pictures, split, seen)
