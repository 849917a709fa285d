"""Where the subject is in each training picture: what the Gaussians say, said to the pixel by the picture itself."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import PlateParams
from facefolds_core.subject.found import background, near_enough, opacity_of, subject_of
from facefolds_core.subject.splats import Splats
from facefolds_core.training.mattes.cut_out import grown
from facefolds_core.training.mattes.known_background import opacity_before
from facefolds_core.training.mattes.plates import from_plate

Array = NDArray[np.float32]
Image = NDArray[np.uint8]
Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class EdgeParams:
    """How an outline is found in a picture.

    Attributes:
        inside, outside: opacities of the Gaussians above and below which they are believed;
        band: and so many pixels off from where they are neither, at a picture of 384 pixels;
        grow: the silhouettes that vote are larger by so many, so that what GrabCut takes away once is not lost.
        share: of the pictures that see a Gaussian and take it for the subject's, at least.
        rounds: how often pictures and Gaussians tell each other.
        soft: pixels on both sides of an outline in which opacity is not 0 or 1, at a picture of 384 pixels.
        noise: standard deviation of what stands behind, of values in [0, 1].
    """

    inside: float = 0.9
    outside: float = 0.3
    band: float = 2.0
    grow: float = 4.0
    share: float = 0.75
    rounds: int = 2
    soft: float = 4.0
    noise: float = 0.1


@dataclass(frozen=True)
class Found:
    """What is the subject.

    Attributes:
        subject: (N,) of the Gaussians.
        cuts: (H, W) by camera, silhouettes in the pictures.
    """

    subject: Bool
    cuts: dict[int, Bool]


def find_subject(scene: Scene, splats: Splats, frame: int = 0, edge: EdgeParams | None = None) -> Found:
    """The body at the centre, as the training pictures of a frame agree on it: what the Gaussians say of each picture
    is said to the pixel by its colours, and these silhouettes vote on the Gaussians."""
    edge, store = edge or EdgeParams(), scene.open_frames()
    cameras = {i: scene.camera_in_head(i, frame) for i in scene.indices("train") if (i, frame) in store}
    subject, cuts = subject_of(splats, scene), dict[int, Bool]()
    possible = near_enough(splats, scene)
    for _ in range(edge.rounds):
        cuts = {
            i: cut_out(store.image(i, frame), opacity_of(splats, subject, one), one, edge) for i, one in cameras.items()
        }
        larger = [(one, grown(cuts[i].astype(np.uint8), _pixels(edge.grow, one)) > 0) for i, one in cameras.items()]
        subject = possible & voted(splats, larger, edge.share)
    return Found(subject, cuts)


def voted(splats: Splats, cuts: list[tuple[Camera, Bool]], share: float) -> Bool:
    """(N,) Gaussians that at least such a share of the silhouettes (H, W) has in whose pictures they lie."""
    seen, inside = np.zeros(len(splats)), np.zeros(len(splats))
    for camera, cut in cuts:
        pixels, depth = camera.project(splats.means.astype(np.float64))
        there = (pixels >= 0).all(1) & (pixels[:, 0] < camera.width) & (pixels[:, 1] < camera.height) & (depth > 0)
        x, y = pixels[there].astype(np.int64).T
        seen += there
        inside[there] += cut[y, x]
    return np.asarray((seen > 0) & (inside >= share * seen))


def find_mattes(
    scene: Scene, splats: Splats, frame: int = 0, cameras: list[int] | None = None, edge: EdgeParams | None = None
) -> dict[int, Image]:
    """Opacity (H, W) 0..255 of the subject by camera, of the training pictures of a frame: given ones first, then those
    beside clean plates.

    Args:
        cameras: others than those that train.
    """
    edge, store, plates, given = edge or EdgeParams(), scene.open_frames(), scene.open_plates(), scene.open_mattes()
    found, mattes = find_subject(scene, splats, frame, edge), dict[int, Image]()
    for index in scene.indices("train") if cameras is None else cameras:
        if (index, frame) not in store:
            continue
        if given is not None and (index, frame) in given:
            mattes[index] = given.image(index, frame)[..., 0]
            continue
        camera, picture = scene.camera_in_head(index, frame), store.image(index, frame)
        if plates is not None and (index, 0) in plates:
            opacity = from_plate(picture, plates.image(index, 0), PlateParams())
        else:
            start = opacity_of(splats, found.subject, camera)
            cut, behind = cut_out(picture, start, camera, edge), background(splats, found.subject, camera)
            opacity = softened(picture, cut, start, behind, camera, edge)
        mattes[index] = np.rint(255 * opacity).astype(np.uint8)
    return mattes


def cut_out(picture: Image, start: Array, camera: Camera, edge: EdgeParams) -> Bool:
    """(H, W) silhouette of the subject in a picture (H, W, 3): GrabCut between what is surely its and surely not.

    Args:
        start: (H, W) opacity of its Gaussians.
    """
    radius = _pixels(edge.band, camera)
    inside = grown((start < edge.inside).astype(np.uint8), radius) == 0
    near = grown((start > edge.outside).astype(np.uint8), radius) > 0
    labels = np.where(start > 0.5, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    labels[inside], labels[~near] = cv2.GC_FGD, cv2.GC_BGD
    cut = start > 0.5
    if near.any() and not near.all() and cut.any():
        cv2.setRNGSeed(0)  # its clusters begin at random
        models, mode = np.zeros((2, 1, 65)), cv2.GC_INIT_WITH_MASK
        cv2.grabCut(np.ascontiguousarray(picture[..., ::-1]), labels, (0, 0, 1, 1), models[0], models[1], 3, mode)
        cut = (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)
    return np.asarray(ndimage.binary_fill_holes(cut))


def softened(picture: Image, cut: Bool, start: Array, behind: Array, camera: Camera, edge: EdgeParams) -> Array:
    """(H, W) opacity in [0, 1] of the subject in a picture (H, W, 3): around its silhouette the geometric mean
    of what the Gaussians say and of what the picture's colours say before what stands behind: both must say it.

    Args:
        start: (H, W) opacity of its Gaussians.
        behind: (H, W, 3) what stands behind them.
    """
    radius = _pixels(edge.soft, camera)
    inside = grown((~cut).astype(np.uint8), radius) == 0
    near = grown(cut.astype(np.uint8), radius) > 0
    if not inside.any() or near.all():
        return cut.astype(np.float32)
    colours = picture.astype(np.float32) / np.float32(255)
    found = opacity_before(colours, np.clip(behind, 0, 1), inside, near & ~inside, edge.noise, PlateParams())
    both = np.sqrt(found * np.clip(start, 0, 1))
    return np.asarray(np.where(inside, np.float32(1), np.where(near, both, np.float32(0))))


def _pixels(width: float, camera: Camera) -> int:
    return max(1, round(width * max(camera.width, camera.height) / 384))
