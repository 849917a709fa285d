"""The embedded actor filmed into arrays, for tests that write it into some layout, and what must come out again.

`film()` is what stood before the cameras: a test writes it as a layout, reads that with the layout's reader, and
`check_same` demands the very cameras and pixels, whatever world and units the layout has.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Literal
from unittest.mock import patch

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Pillow

from facefolds_core.captures.actor import ActorOptions, frame_times, make_rig, render
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.capture import Capture, closest_rotation
from facefolds_core.captures.scene import Scene
from facefolds_core.captures.sources import SOURCES
from facefolds_core.errors import UserError
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.params import CaptureParams, NormalizeParams, Subject
from tests.captures.fixtures import intrinsics, opengl_matrix, save

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
HELD_OUT = 2
"""Which camera `scene_of` holds out; its mattes are compared."""
FRONT = 0
"""The camera that faces the actor: 3 degrees beside, 2 above."""


@dataclass(frozen=True)
class Film:
    """What a few cameras saw.

    Attributes:
        cameras: C, pinholes in the actor's world (mm, x right, y down), continuous pixel coordinates.
        fps: frames a second.
        images: (C, K, H, W, 3) uint8 RGB.
        mattes: (C, K, H, W) uint8: true opacity of the actor (hair included), 255 is opaque.
        plates: (C, H, W, 3) uint8: the same cameras before the empty room.
    """

    cameras: tuple[Camera, ...]
    fps: float
    images: Image
    mattes: Image
    plates: Image

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(camera.name for camera in self.cameras)

    @property
    def frames(self) -> int:
        return self.images.shape[1]


@lru_cache(maxsize=4)
def film(cameras: int = 5, frames: int = 3, width: int = 48, height: int = 64) -> Film:
    """The actor, filmed; kept for the session (a picture of 48 x 64 takes 30 ms)."""
    params = CaptureParams(cameras=cameras, frames=frames, width=width, height=height)
    rig = make_rig(params).cameras
    options = ActorOptions()
    pictures = [[render(camera, float(t), options) for t in frame_times(params)] for camera in rig]
    away = np.eye(3), np.array([0.0, 0.0, 1e7])
    with patch("facefolds_core.captures.actor.render.head_pose", lambda *_: away):
        plates = [render(camera, 0.0, options) for camera in rig]
    assert not any(plate.opacity.any() for plate in plates)
    return Film(
        cameras=rig,
        fps=30.0,
        images=np.array([[p.rgb for p in row] for row in pictures]),
        mattes=np.array([[np.rint(255 * p.opacity).astype(np.uint8) for p in row] for row in pictures]),
        plates=np.array([plate.rgb for plate in plates]),
    )


class Reader:
    """What reads a capture of a layout: from a place, with keys of its subject besides those given here."""

    def __init__(self, source: str, **given: object) -> None:
        self.source, self.given = source, given

    def __call__(self, root: Path, **keys: object) -> Capture:
        subject = Subject(source=self.source, path="x", **{**self.given, **keys})  # type: ignore[arg-type]
        capture: Capture = SOURCES[self.source].read(root, subject)
        return capture

    def refused(self, root: Path, message: str, *words: object, **keys: object) -> None:
        """AssertionError unless it refuses with that message, and says these words."""
        with pytest.raises(UserError) as caught:
            self(root, **keys)
        missing = [word for word in words if str(word) not in str(caught.value)]
        assert message in caught.value.message and not missing, caught.value


def scene_of(root: Path, source: str, folder: Path, names: tuple[str, ...], **subject: object) -> Scene:
    """`normalize` as a function: the capture at `root`, of layout `source`, written as a scene into `folder`.

    Args:
        names: what the layout calls the film's cameras, in their order.
        subject: more keys of the subject.
    """
    keys = {"holdout": (names[HELD_OUT],), "front": names[FRONT], **subject}
    entry = Subject(source=source, path=str(root), **keys)  # type: ignore[arg-type]
    capture = SOURCES[source].read(root, entry)
    params = NormalizeParams()
    return write_plan(plan_scene(capture, "filmed", entry, params, folder), params)


def save_pictures(folder: Path, names: Sequence[str], pictures: Image) -> None:
    """(C, K, H, W, 3) or (C, K, H, W) as folder/NAME/000000.png."""
    for name, row in zip(names, pictures, strict=True):
        for k, picture in enumerate(row):
            save(folder / name / f"{k:06d}.png", picture)


def save_jpeg(path: Path, image: Image) -> None:
    """As good as JPEG gets: 48 dB and more."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Pillow.fromarray(image).save(path, quality=100, subsampling=0)


def save_video(
    path: Path,
    images: Image,
    fps: float,
    times: Sequence[int] | None = None,
    container: Mapping[str, str] | None = None,
) -> None:
    """(K, H, W, 3) as H.264 without loss; `times` in frames, `container` are its options."""
    path.parent.mkdir(parents=True, exist_ok=True)
    base = Fraction(1, 100 * round(fps))
    with av.open(str(path), "w", options=dict(container or {})) as file:
        stream = file.add_stream("libx264rgb", rate=round(fps), options={"crf": "0", "g": "5"})
        stream.height, stream.width, stream.pix_fmt = images.shape[1], images.shape[2], "rgb24"
        stream.codec_context.time_base = base
        for k, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image, "rgb24")
            frame.pts, frame.time_base = 100 * (k if times is None else times[k]), base
            file.mux(stream.encode(frame))
        file.mux(stream.encode())


def moved(camera: Camera, jitter: float, seed: int) -> Camera:
    """Its pose after its place moved by `jitter` of 1000 mm, its axes by `jitter` radians."""
    random = np.random.default_rng(seed)
    turned = closest_rotation(camera.w2c + jitter * np.pad(random.normal(size=(3, 3)), ((0, 0), (0, 1))))
    centre = camera.centre + 1000 * jitter * random.normal(size=3)
    return replace(camera, w2c=np.concatenate([turned[:, :3], -(turned[:, :3] @ centre)[:, None]], 1))


def write_film(root: Path, labels: str, jitter: float = 0.0, timed: bool = False, **first: object) -> Path:
    """The film in transforms.json, each picture with a pose of its own, the last frames first.

    `labels` has camera c, frame k and number n; `first` are keys of the first entry.
    """
    truth, entries = film(), []
    for c, camera in enumerate(truth.cameras):
        for k in reversed(range(truth.frames)):
            label = labels.format(c=camera.name, k=k, n=c * truth.frames + k)
            save(root / label, truth.images[c, k])
            pose = moved(camera, jitter, 10 * c + k) if jitter else camera
            entry = {"file_path": label, "transform_matrix": opengl_matrix(pose), **intrinsics(camera)}
            entries.append(entry | ({"time": k / truth.fps} if timed else {}))
    entries[0] |= first
    (root / "transforms.json").write_text(json.dumps({"frames": entries}))
    return root


def relating(found: list[Camera], expected: list[Camera]) -> Similarity:
    """The similarity that takes the expected cameras' world to the found ones', by least squares."""
    u, _, vt = np.linalg.svd(sum(f.rotation.T @ e.rotation for f, e in zip(found, expected, strict=True)))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    to, origin = np.array([c.centre for c in found]), np.array([c.centre for c in expected]) @ rotation.T
    to_middle, origin_middle = to.mean(0), origin.mean(0)
    a, b = to - to_middle, origin - origin_middle
    scale = float((a * b).sum() / (b * b).sum())
    return Similarity(scale, rotation, to_middle - scale * origin_middle)


def check_same(
    scene: Scene,
    truth: Film,
    names: Mapping[str, str] | None = None,
    *,
    lossless: bool = True,
    mattes: Literal["", "held", "all"] = "",
    tolerance: float = 1e-6,
) -> None:
    """AssertionError unless the scene has all cameras and frames of the film, and its pixels.

    Args:
        names: the scene's name of a camera -> the film's; None where they are the same.
        lossless: pixels must be equal; else PSNR > 45 dB, each picture.
        mattes: the held-out cameras' masks, or all cameras' mattes too, must be equal (lossless) or within 45 dB.
        tolerance: of w2c (median distance of the cameras: 1) and of K over the picture's width.
    """
    by_name = {camera.name: c for c, camera in enumerate(truth.cameras)}
    order = [by_name[names[camera.name] if names else camera.name] for camera in scene.cameras]
    assert sorted(order) == list(range(len(truth.cameras))), f"cameras {[c.name for c in scene.cameras]}"
    assert scene.num_frames == truth.frames
    expected = [truth.cameras[c] for c in order]
    similarity = relating(list(scene.cameras), expected)
    for found, camera in zip(scene.cameras, expected, strict=True):
        assert (found.width, found.height) == (camera.width, camera.height)
        w2c = camera.transformed(similarity).w2c
        np.testing.assert_allclose(found.w2c, w2c, rtol=0, atol=tolerance, err_msg=f"pose of {found.name}")
        np.testing.assert_allclose(
            found.K / camera.width, camera.K / camera.width, rtol=0, atol=tolerance, err_msg=f"K of {found.name}"
        )
    if truth.frames > 1:
        np.testing.assert_allclose(np.diff(scene.times), 1 / truth.fps, rtol=1e-6, err_msg="times")
    store = scene.open_frames()
    for i, c in enumerate(order):
        for k in range(truth.frames):
            _check_picture(
                store.image(i, k), truth.images[c, k], lossless, f"camera {scene.cameras[i].name}, frame {k}"
            )
    if mattes:
        masks, all_mattes = scene.open_masks(), scene.open_mattes()
        assert masks is not None, "no masks"
        for i in range(len(order)):
            for k in range(truth.frames):
                place = f"matte of camera {scene.cameras[i].name}, frame {k}"
                if scene.splits[i] == "holdout":
                    _check_picture(masks.image(i, k)[..., 0], truth.mattes[order[i], k], lossless, place)
                if mattes == "all":
                    assert all_mattes is not None, "no mattes"
                    _check_picture(all_mattes.image(i, k)[..., 0], truth.mattes[order[i], k], lossless, place)


def _check_picture(found: Image, expected: Image, lossless: bool, place: str) -> None:
    if lossless:
        np.testing.assert_array_equal(found, expected, err_msg=place)
        return
    error = float(np.mean((found.astype(float) - expected) ** 2))
    psnr = 10 * np.log10(255**2 / max(error, 1e-9))
    assert psnr > 45, f"{place}: {psnr:.1f} dB"
