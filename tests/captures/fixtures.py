"""Tiny synthetic captures on disk: a textured box of points seen by a ring of cameras, in both layouts."""

from __future__ import annotations

import io
import json
import math
import wave
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from facefolds_core.captures.assembly import Plan, plan_scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import NormalizeParams, Subject
from facefolds_core.registry import SOURCES

Array = NDArray[np.float64]
SEGMENT = "E001_Neutral"
HEAD = np.array([12.0, -7.0, 1030.0])
"""Where the head's origin is in the capture's world, millimetres; the world's y points down, as in Multiface."""
HEAD_TO_WORLD = np.diag([1.0, -1.0, -1.0])
VERTICES = np.array([[x, y, z] for x in (-60, 60) for y in (-100, 100) for z in (-80, 80)], float)
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]])


def world_camera(name: str, azimuth: float, elevation: float, size: tuple[int, int] = (40, 64)) -> Camera:
    """A camera 1000 mm from the head, looking at it; degrees as the head sees them; K in continuous coordinates."""
    a, e = math.radians(azimuth), math.radians(elevation)
    outward = HEAD_TO_WORLD @ np.array([math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)])
    forward = -outward
    down = -HEAD_TO_WORLD[:, 1]
    x = np.cross(down, forward)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(forward, x), forward])
    width, height = size
    K = np.array([[150.0, 0, 0.55 * width], [0, 151.0, 0.48 * height], [0, 0, 1]])
    return Camera(name, K, np.concatenate([R, (-R @ (HEAD + 1000 * outward))[:, None]], 1), width, height)


RING = (("400001", -60, 0), ("400002", -20, 10), ("400003", 0, 0), ("400004", 20, -10), ("400005", 60, 0))


@dataclass(frozen=True)
class MultifaceCapture:
    """A capture in the Multiface layout.

    Attributes:
        root: its folder.
        cameras: in continuous pixel coordinates, at the size of the images.
        frames: names.
    """

    root: Path
    cameras: tuple[Camera, ...]
    frames: tuple[str, ...]

    @property
    def krt(self) -> Path:
        return self.root / "KRT"

    def image(self, camera: str, frame: str) -> Path:
        return self.root / "images" / SEGMENT / camera / f"{frame}.png"

    def mesh(self, frame: str, suffix: str) -> Path:
        return self.root / "tracked_mesh" / SEGMENT / f"{frame}{suffix}"


def pattern(width: int, height: int, seed: int) -> NDArray[np.uint8]:
    """(height, width, 3) noise."""
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def save(path: Path, image: NDArray[Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Pillow.fromarray(image).save(path)


def encoded(image: NDArray[Any], kind: str, **options: object) -> bytes:
    """A picture's bytes, as Pillow writes them."""
    buffer = io.BytesIO()
    Pillow.fromarray(image).save(buffer, kind, **options)
    return buffer.getvalue()


def save_wav(path: Path, samples: NDArray[Any], rate: int) -> None:
    """16 bits, one channel."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, rate, 0, "NONE", ""))
        file.writeframes(samples.astype("<i2").tobytes())


def plan_of(root: Path, params: NormalizeParams | None = None, source: str = "multiface", **keys: Any) -> Plan:
    """What `normalize` would make of a capture, in `scene` beside it; `keys` are the subject's."""
    subject = Subject(source=source, path=str(root), **{"holdout": ("400003",), "front": "400003", **keys})
    capture = SOURCES[source].read(root, subject)
    return plan_scene(capture, "head", subject, params or NormalizeParams(), root.parent / "scene")


def krt_text(cameras: tuple[Camera, ...], scale: float = 1.0, pixel_centres: float = 0.0) -> str:
    """KRT for images `scale` times as large as the cameras'."""
    blocks = []
    for camera in cameras:
        K = np.diag([scale, scale, 1.0]) @ camera.K
        K[:2, 2] -= 0.5 - pixel_centres
        rows = [*K.tolist(), [0.0] * 5, *camera.w2c.tolist()]
        blocks.append("\n".join([camera.name, *(" ".join(map(repr, row)) for row in rows)]))
    return "\n\n".join(blocks) + "\n"


def write_obj(path: Path, vertices: Array) -> None:
    lines = ["v " + " ".join(f"{x:.9g}" for x in v) for v in vertices]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in face) for face in FACES]
    path.write_text("\n".join(lines) + "\n")


def write_multiface(
    root: Path, frames: tuple[str, ...] = ("000003", "000006", "000009"), turn: float = 0.0
) -> MultifaceCapture:
    """A complete capture of `RING`; the head moves by (3, 1, -2) mm a frame and turns by `turn` degrees."""
    cameras = tuple(world_camera(*view) for view in RING)
    capture = MultifaceCapture(root, cameras, frames)
    root.mkdir(parents=True, exist_ok=True)
    capture.krt.write_text(krt_text(cameras))
    (root / "frame_list.txt").write_text("".join(f"{SEGMENT} {frame}\n" for frame in frames))
    for k, frame in enumerate(frames):
        for c, camera in enumerate(cameras):
            save(capture.image(camera.name, frame), pattern(camera.width, camera.height, 100 * c + k))
        capture.mesh(frame, ".obj").parent.mkdir(parents=True, exist_ok=True)
        write_obj(capture.mesh(frame, ".obj"), VERTICES)
        VERTICES.astype("<f4").tofile(capture.mesh(frame, ".bin"))
        capture.mesh(frame, "_transform.txt").write_text(pose_text(*head_pose(k, turn)))
    return capture


def head_pose(k: int, turn: float = 0.0) -> tuple[Array, Array]:
    """Head -> world of frame k: (3, 3) and (3,)."""
    a = math.radians(turn * k)
    about_y = np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
    return HEAD_TO_WORLD @ about_y, HEAD + k * np.array([3.0, 1.0, -2.0])


def pose_text(rotation: Array, translation: Array) -> str:
    rows = np.concatenate([rotation, translation[:, None]], 1).tolist()
    return "\n".join(" ".join(map(repr, row)) for row in rows) + "\n"


def opengl_matrix(camera: Camera) -> list[list[float]]:
    """Camera -> world with OpenGL axes, (4, 4), as transforms.json has it."""
    c2w = np.eye(4)
    c2w[:3, :3] = camera.rotation.T @ np.diag([1.0, -1.0, -1.0])
    c2w[:3, 3] = camera.centre
    matrix: list[list[float]] = c2w.tolist()
    return matrix


def intrinsics(camera: Camera) -> dict[str, float]:
    K = camera.K
    return {"fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2], "cy": K[1, 2], "w": camera.width, "h": camera.height}


def write_transforms(root: Path, **changes: Any) -> tuple[Path, tuple[Camera, ...]]:
    """A static capture of `RING` in transforms.json with per-frame intrinsics; `changes` are keys at the top."""
    cameras = tuple(world_camera(*view) for view in RING)
    entries = []
    for c, camera in enumerate(cameras):
        save(root / "images" / f"{camera.name}.png", pattern(camera.width, camera.height, c))
        entries.append(
            {"file_path": f"images/{camera.name}.png", "transform_matrix": opengl_matrix(camera), **intrinsics(camera)}
        )
    path = root / "transforms.json"
    path.write_text(json.dumps({"frames": entries, **changes}))
    return path, cameras


def edit_transforms(path: Path, entry: int, **changes: Any) -> None:
    """Change keys of one entry; None deletes the key."""
    value = json.loads(path.read_text())
    for key, new in changes.items():
        value["frames"][entry].pop(key, None)
        if new is not None:
            value["frames"][entry][key] = new
    path.write_text(json.dumps(value))
