"""How fast videos become a scene, beside how fast they can be decoded at all.

    python -m bench.decode --videos 16 --frames 300

Clips are made (a picture that drifts, with noise: about 60 kB a frame), then (1) decoded only, one after the other with
FFmpeg's own threads, as `ffmpeg -i FILE -f null -` does (by ffmpeg if it is installed, else by PyAV), and (2) read as
Neural 3D Video by what `normalize` calls. Prints seconds and their ratio.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import av
import cv2
import numpy as np

from facefolds_core.captures.actor import make_rig
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.sources.neural3d import read
from facefolds_core.params import CaptureParams, NormalizeParams, Subject


def make_capture(folder: Path, videos: int, frames: int, width: int, height: int) -> None:
    """Neural 3D Video: one clip under many names, and poses of the actor's rig."""
    rng = np.random.default_rng(0)
    base = cv2.resize(
        rng.integers(0, 240, (70, 100, 3), dtype=np.uint8), (width, height), interpolation=cv2.INTER_CUBIC
    )
    noise = rng.integers(0, 12, (height, width, 3), dtype=np.uint8)
    with av.open(str(folder / "cam00.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=24, options={"crf": "18"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for k in range(frames):
            picture = np.roll(base, 3 * k, 1) // 16 * 15 + np.roll(noise, k, 0)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())
    rig = make_rig(CaptureParams(cameras=videos, width=width, height=height)).cameras
    rows = []
    for i, camera in enumerate(rig):
        right, down, forward = camera.rotation
        size = [height, width, camera.K[0, 0]]
        rows.append([*np.stack([down, right, -forward, camera.centre, size], 1).ravel(), 500, 2000])
        if i:
            os.link(folder / "cam00.mp4", folder / f"cam{i:02d}.mp4")
    np.save(folder / "poses_bounds.npy", np.array(rows))


def decode_only(file: Path) -> None:
    """All frames, thrown away."""
    if shutil.which("ffmpeg"):
        subprocess.run(["ffmpeg", "-v", "error", "-i", str(file), "-f", "null", "-"], check=True)
        return
    with av.open(str(file)) as container:
        container.streams.video[0].thread_type = "AUTO"
        for _ in container.decode(video=0):
            pass


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    for name, default in (("videos", 16), ("frames", 300), ("width", 1604), ("height", 1100), ("repeats", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    wanted = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "clips"
        folder.mkdir()
        make_capture(folder, wanted.videos, wanted.frames, wanted.width, wanted.height)
        subject = Subject(source="neural3d", path=str(folder), front="cam00", holdout=("cam01",))
        for _ in range(wanted.repeats):
            times = [(time.perf_counter(), time.process_time())]
            for file in sorted(folder.glob("*.mp4")):
                decode_only(file)
            times.append((time.perf_counter(), time.process_time()))
            capture = read(folder, subject, CaptureParams())
            write_plan(plan_scene(capture, "clips", subject, params := NormalizeParams(), folder / "scene"), params)
            times.append((time.perf_counter(), time.process_time()))
            (decoded, cpu), (made, more) = np.diff(times, axis=0)
            print(f"decode only {decoded:.1f} s ({cpu:.1f} s of processors), scene {made:.1f} s ({more:.1f} s)")
            print(
                f"ratio {made / decoded:.2f} ({more / cpu:.2f}), {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
            )


if __name__ == "__main__":
    main()
