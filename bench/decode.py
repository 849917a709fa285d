"""How fast videos become a scene, beside how fast they can be decoded at all.

    python -m bench.decode --videos 16 --frames 300

Clips are made (a picture that drifts, with noise: about 60 kB a frame), then (1) decoded only, one after the other with
FFmpeg's own threads, and (2) read as Neural 3D Video by what `normalize` calls. Prints seconds and their ratio.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import av
import cv2
import numpy as np
import typer

from facefolds_core.captures.actor import make_rig
from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.captures.sources.neural3d import read
from facefolds_core.params import CaptureParams, NormalizeParams, Subject


def make_capture(folder: Path, videos: int, frames: int, width: int, height: int) -> None:
    """Neural 3D Video: one clip under many names, and poses of the actor's rig."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 240, (70, 100, 3), dtype=np.uint8)
    base = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    noise = rng.integers(0, 12, (height, width, 3), dtype=np.uint8)
    with av.open(str(folder / "cam00.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=24, options={"crf": "18"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for k in range(frames):
            picture = np.roll(base, 3 * k, 1) // 16 * 15 + np.roll(noise, k, 0)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())
    rows = []
    for i, camera in enumerate(make_rig(CaptureParams(cameras=videos, width=width, height=height)).cameras):
        right, down, forward = camera.rotation
        size = [height, width, camera.K[0, 0]]
        rows.append([*np.stack([down, right, -forward, camera.centre, size], 1).ravel(), 500, 2000])
        if i:
            os.link(folder / "cam00.mp4", folder / f"cam{i:02d}.mp4")
    np.save(folder / "poses_bounds.npy", np.array(rows))


def main(videos: int = 16, frames: int = 300, width: int = 1604, height: int = 1100) -> None:
    """Compare once; no threshold: times depend on what else the machine does."""
    with TemporaryDirectory() as temporary:
        make_capture(folder := Path(temporary), videos, frames, width, height)
        times = [(time.perf_counter(), time.process_time())]
        for file in sorted(folder.glob("*.mp4")):
            with av.open(str(file)) as container:
                container.streams.video[0].thread_type = "AUTO"
                for _ in container.decode(video=0):
                    pass
        times.append((time.perf_counter(), time.process_time()))
        subject = Subject(source="neural3d", path=temporary, front="cam00", holdout=("cam01",))
        plan = plan_scene(read(folder, subject, CaptureParams()), "clips", subject, NormalizeParams(), folder / "scene")
        write_plan(plan, NormalizeParams())
        times.append((time.perf_counter(), time.process_time()))
    (decoded, cpu), (made, more) = np.diff(times, axis=0)
    typer.echo(f"decode only {decoded:.1f} s ({cpu:.1f} s of processors), scene {made:.1f} s ({more:.1f} s)")
    typer.echo(f"ratio {made / decoded:.2f} ({more / cpu:.2f}), {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    typer.run(main)
