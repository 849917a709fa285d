"""Write the actor as a capture in the Multiface layout, with what Multiface lacks: true opacity, clean plates.

Where espeak-ng is installed she has a voice, as Multiface's people do: `audio/PERFORMANCE.wav`, each phrase while the
mouth says it.
"""

from __future__ import annotations

import io
import math
import shutil
import subprocess
import wave
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.actor.mesh import TrackedMesh, tracked_mesh
from facefolds_core.captures.actor.motion import PERIOD, head_pose
from facefolds_core.captures.actor.render import ActorOptions, render
from facefolds_core.captures.actor.rig import ActorRig, make_rig
from facefolds_core.captures.actor.speech import PHRASES
from facefolds_core.files.writing import atomic_folder
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import CaptureParams

SEGMENT = "PERFORMANCE"
Progress = Callable[[], None]
"""Called once after each picture."""

PROGRAM = "espeak-ng"
VOICE = "en-us+f3"
WORDS_A_MINUTE, SLOWEST, FASTEST = 160, 80, 400
"""Of the first try; what the program takes."""
SILENT = 0.01
"""Of the loudest sample: what is fainter before and after a phrase is cut off."""

Samples = NDArray[np.int16]


def frame_times(params: CaptureParams) -> NDArray[np.float64]:
    """(frames,) seconds within the take: evenly spread, the last one a step before the end, so that the film loops."""
    return np.arange(params.frames) / params.frames * params.seconds


def krt_block(camera: Camera) -> str:
    """One camera of a Multiface `KRT` file: name, K (3 rows), 5 distortion values, [R | t] (3 rows), blank line.

    Multiface counts pixels from their centres: the first pixel's centre is (0, 0), half a pixel from our convention.
    """
    K = camera.K.copy()
    K[:2, 2] -= 0.5
    rows = [*K.tolist(), [0.0] * 5, *camera.w2c.tolist()]
    return "\n".join([camera.name, *(" ".join(f"{x:.10g}" for x in row) for row in rows), "", ""])


def _write_png(path: Path, image: NDArray[np.uint8]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    encoded, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not encoded:
        raise OSError(f"cannot encode {path}")
    path.write_bytes(data.tobytes())


def _write_mesh(folder: Path, frame: str, mesh: TrackedMesh, head_to_world: NDArray[np.float64]) -> None:
    """`.obj` (vertices, texture coordinates, triangles), `.bin` (float32 vertices), `_transform.txt` (3 x 4)."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv.tolist()]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in (mesh.faces + 1).tolist()]
    (folder / f"{frame}.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / f"{frame}.bin").write_bytes(mesh.vertices.astype("<f4").tobytes())
    rows = "\n".join(" ".join(f"{x:.10g}" for x in row) for row in head_to_world.tolist())
    (folder / f"{frame}_transform.txt").write_text(rows + "\n", encoding="utf-8")


def write_capture(
    folder: str | Path,
    params: CaptureParams,
    progress: Progress | None = None,
    options: ActorOptions | None = None,
    rig: ActorRig | None = None,
) -> None:
    """Render and write a capture; `folder` appears whole or not at all.

    Args:
        folder: replaced if it exists.
        params: cameras, frames, size.
        progress: called after each of the cameras x frames pictures.
        options: see `ActorOptions`; by default as `params` have it.
        rig: other cameras than those of `make_rig`.
    """
    options = options or ActorOptions(head_motion=math.radians(params.head_motion), clutter=params.clutter)
    rig = rig or make_rig(params)
    with atomic_folder(folder) as temporary:
        (temporary / "KRT").write_text("".join(krt_block(camera) for camera in rig.cameras), encoding="utf-8")
        frames = [(f"{k + 1:06d}", float(time)) for k, time in enumerate(frame_times(params))]
        listing = "".join(f"{SEGMENT} {name}\n" for name, _ in frames)
        (temporary / "frame_list.txt").write_text(listing, encoding="utf-8")
        if params.plates:
            for camera in rig.cameras:
                plate = render(camera, 0.0, replace(options, away=1.0))
                _write_png(temporary / "plates" / f"{camera.name}.png", plate.rgb[..., ::-1])
        speak(temporary / "audio" / f"{SEGMENT}.wav", params.seconds)
        for name, time in frames:
            rotation, translation = head_pose(time, options.head_motion)
            head_to_world = np.concatenate([rotation, translation[:, None]], 1)
            _write_mesh(temporary / "tracked_mesh" / SEGMENT, name, tracked_mesh(time, options.nose), head_to_world)
            for camera in rig.cameras:
                picture = render(camera, time, options)
                mask = np.rint(255 * picture.opacity).astype(np.uint8)
                kinds = {"images": picture.rgb[..., ::-1], "masks": mask} | ({"mattes": mask} if params.mattes else {})
                for kind, image in kinds.items():
                    _write_png(temporary / kind / SEGMENT / camera.name / f"{name}.png", image)
                if progress:
                    progress()


def speak(path: Path, seconds: float) -> bool:
    """Write the sound of the take's first `seconds`, as WAV; False, and nothing is written, without espeak-ng."""
    if shutil.which(PROGRAM) is None:
        return False
    rate = phrase(PHRASES[0][0], WORDS_A_MINUTE)[1]
    take = np.zeros(round(PERIOD * rate), np.int16)
    for words, begin, end in PHRASES:
        said = fitted(words, end - begin)
        start = round(begin * rate)
        take[start : start + len(said)] = said
    path.parent.mkdir(parents=True, exist_ok=True)
    with wave.open(str(path), "wb") as out:
        out.setparams((1, take.itemsize, rate, 0, "NONE", ""))
        out.writeframes(np.resize(take, round(seconds * rate)).tobytes())
    return True


def fitted(words: str, seconds: float) -> Samples:
    """A phrase at the speed at which it takes that long, or a little less."""
    said, rate = phrase(words, WORDS_A_MINUTE)
    speed = round(WORDS_A_MINUTE * len(said) / rate / seconds)
    return phrase(words, min(max(speed, SLOWEST), FASTEST))[0][: round(seconds * rate)]


def phrase(words: str, speed: int) -> tuple[Samples, int]:
    """What espeak-ng says, without the silence around it, and samples a second."""
    command = [PROGRAM, "-v", VOICE, "-s", str(speed), "--stdout", words]
    with wave.open(io.BytesIO(subprocess.run(command, check=True, capture_output=True).stdout)) as sound:
        rate, data = sound.getframerate(), sound.readframes(sound.getnframes())
    samples = np.frombuffer(data[: len(data) // 2 * 2], "<i2")
    loud = np.flatnonzero(np.abs(samples.astype(int)) > SILENT * np.abs(samples.astype(int)).max())
    return samples[loud[0] : loud[-1] + 1], rate
