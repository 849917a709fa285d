"""Memory and time of every stage by the length of the take.

python -m bench.takes FOLDER [--frames 60,240,960]

The actor is filmed in small pictures, at a rate at which no two frames of her loop are alike: equal ones are trained
once. Each stage runs in a process of its own; two more fit segments. Memory is anonymous memory, of the process and its
children together, at most: pages of mapped files can be taken back at any time, and are not counted. The shortest take
is made once before, so that nothing is compiled while it is measured.
"""

from __future__ import annotations

import os
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import psutil
import typer

from bench.run import Project
from bench.tables import markdown
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import write_json
from facefolds_core.params import STAGE_SECTIONS, merged

RATE = 40.0618
"""Frames a second: 160.2472 a loop of 4 s."""

WATCH = 0.1
"""Seconds between two looks at a stage's memory."""

PARAMS: dict[str, Any] = {
    "capture": {"cameras": 6, "height": 64, "width": 48},
    "normalize": {},
    "train": {"preset": "fast", "segments": {"key_frames": 16, "processes": 2}},
    "sample": {"resolution": 128},
    "reconstruct": {},
    "decimate": {"resolution": 24},
    "texture": {"resolution": 128},
    "bake": {},
    "compress": {},
    "evaluate": {},
}
"""params.yaml but for the subject."""


@dataclass(frozen=True)
class Watched:
    """Of a stage: seconds, seconds of processor, bytes of anonymous memory at most, bytes in the subject's folder."""

    seconds: float
    processor: float
    memory: int


def anonymous(process: psutil.Process) -> int:
    """Bytes of a process and its children; 0 of those that have ended."""
    total = 0
    with suppress(psutil.NoSuchProcess):
        for one in [process, *process.children(recursive=True)]:
            with suppress(OSError):
                lines = Path(f"/proc/{one.pid}/status").read_text(encoding="utf-8").splitlines()
                kib = [line.split()[1] for line in lines if line.startswith(("RssAnon:", "RssShmem:"))]
                total += 1024 * sum(map(int, kib))
    return total


def watched(project: Project, stage: str) -> Watched:
    """Run a stage's command.

    Raises:
        UserError: if it fails.
    """
    log = project.root / f"{stage}.log"
    start, peak = time.perf_counter(), 0
    before = os.times()
    with log.open("w") as out, project.begin(stage, out, out) as running:
        process = psutil.Process(running.pid)
        while running.poll() is None:
            peak = max(peak, anonymous(process))
            time.sleep(WATCH)
    after = os.times()
    if running.returncode:
        raise UserError(f"{stage} failed", file=log, remedy="read the log")
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return Watched(time.perf_counter() - start, used, peak)


def measure(folder: Path, frames: int) -> dict[str, Watched]:
    """All stages of a take, by their names."""
    project = Project(folder / f"frames{frames}", "take")
    subject = {"source": "actor", "path": "facefolds_core/captures/actor", "holdout": {"every": 6}}
    film = {"capture": {"frames": frames, "seconds": frames / RATE}}
    project.write(merged({"subjects": {"take": subject}, **PARAMS}, film))
    project.run("configure")
    found = {}
    for stage in STAGE_SECTIONS:
        found[stage] = watched(project, stage)
        typer.echo(f"{frames} frames, {stage}: {found[stage].seconds:.1f} s, {found[stage].memory / 1e6:.0f} MB")
    return found


def table(found: dict[int, dict[str, Watched]]) -> str:
    """A row a stage: memory and processor time of each length, and how they grow from the shortest to the longest."""
    lengths = sorted(found)
    head = ["stage", *(f"MB, {k} frames" for k in lengths), "growth", *(f"s, {k} frames" for k in lengths), "growth"]
    rows = []
    for stage in STAGE_SECTIONS[1:]:  # the actor is filmed picture by picture
        runs = [found[k][stage] for k in lengths]
        memory, seconds = [run.memory for run in runs], [run.processor for run in runs]
        megabytes = [*(f"{value / 1e6:.0f}" for value in memory), f"{memory[-1] / memory[0]:.2f}"]
        times = [*(f"{value:.1f}" for value in seconds), f"{seconds[-1] / seconds[0]:.1f}"]
        rows.append([stage, *megabytes, *times])
    return markdown(head, rows)


def main(
    folder: Annotated[Path, typer.Argument(help="Where the takes are made; some GB.")],
    frames: Annotated[str, typer.Option(help="Lengths of the takes.")] = "60,240,960",
) -> None:
    """Measure every stage on takes of several lengths."""
    with report_user_errors("takes"):
        lengths = [int(k) for k in frames.split(",")]
        measure(folder / "before", min(lengths))
        found = {k: measure(folder, k) for k in lengths}
        write_json(folder / "takes.json", {k: {s: vars(w) for s, w in one.items()} for k, one in found.items()})
        typer.echo(table(found))


if __name__ == "__main__":
    typer.run(main)
