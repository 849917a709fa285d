"""How fast a capture's videos become a scene, beside how fast they can be decoded at all.

    python -m bench.decode FOLDER --front cam00

The videos are (1) decoded only, one after the other with FFmpeg's own threads, and (2) read by what `normalize` calls.
Prints seconds and their ratio, which mean something on an idle machine and on clips of some hundred frames only.
"""

from __future__ import annotations

import os
import time
from collections import deque
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import av
import numpy as np
import typer

from facefolds_core.captures.assembly import plan_scene, write_plan
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.params import CaptureParams, NormalizeParams, Subject
from facefolds_core.registry import SOURCES


def main(
    folder: Annotated[Path, typer.Argument(help="A capture of MP4 files.")],
    front: Annotated[str, typer.Option(help="The camera before the face.")],
    source: Annotated[str, typer.Option(help="The capture's layout, as in params.yaml.")] = "neural3d",
) -> None:
    """Decode all videos, then make the scene of them."""
    with report_user_errors("decode"), TemporaryDirectory() as temporary:
        if source not in SOURCES.names or not (files := sorted(folder.rglob("*.mp4"))):
            raise UserError("no capture of videos", file=folder, found=source, expected=", ".join(SOURCES.names))
        times = [(time.perf_counter(), time.process_time())]
        for file in files:
            with av.open(str(file)) as container:
                container.streams.video[0].thread_type = "AUTO"
                deque(container.decode(video=0), 0)
        times.append((time.perf_counter(), time.process_time()))
        subject = Subject.model_validate({"source": source, "path": str(folder), "front": front, "holdout": []})
        capture = SOURCES[source].read(folder, subject, CaptureParams())
        params = NormalizeParams()
        write_plan(plan_scene(capture, "clips", subject, params, Path(temporary) / "scene"), params)
        times.append((time.perf_counter(), time.process_time()))
        (decoded, cpu), (made, more) = np.diff(times, axis=0)
        typer.echo(f"decode only {decoded:.1f} s ({cpu:.1f} s of processors), scene {made:.1f} s ({more:.1f} s)")
        typer.echo(f"ratio {made / decoded:.2f} ({more / cpu:.2f}), load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    typer.run(main)
