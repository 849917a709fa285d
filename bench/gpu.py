"""The GPU beside the CPU: `python -m bench.gpu FOLDER --mugsy CAPTURE --write`, on a machine with an NVIDIA GPU.

First the tests of tests/gpu on that GPU instead of the simulator; then `actor`, `mugsy` and a take of Multiface's size
(the actor with 60 frames of 768 x 512), each trained on the CPU and on the GPU, one after the other, from the same
scene. Seconds and rays a second are of the first training of a process: compiling for the GPU is counted.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from bench.results import ROOT, commit_name, machine_name, now
from bench.run import Project, own_params, training_of
from bench.speed_accuracy import score
from bench.tables import markdown, replace_between
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.params import merged
from facefolds_core.training.device import choose

MARKS = ("<!-- gpu: written by bench/gpu.py -->", "<!-- end of gpu -->")
MULTIFACE = {"capture": {"frames": 60, "height": 768, "width": 512}}
HEAD = ("take", "trained on", "seconds", "dB on validation views", "peak memory", "rays a second")


def check() -> str:
    """Run tests/gpu on the GPU; what pytest says last.

    Raises:
        UserError: if one fails.
    """
    command = [sys.executable, "-m", "pytest", "-q", "tests/gpu"]
    environment = {**os.environ, "FACEFOLDS_GPU": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UserError("the kernels' tests fail on this GPU", place="tests/gpu", found=done.stdout[-2000:])
    return done.stdout.strip().splitlines()[-1]


def projects(folder: Path, mugsy: Path | None) -> dict[str, tuple[Project, dict[str, Any]]]:
    """By take: where it is trained, and its params.yaml but for the device."""
    actor = own_params("actor", {})
    found = {"actor": actor, "Multiface's size": merged(actor, MULTIFACE)}
    if mugsy is not None:
        subject = {"source": "multiface", "path": str(mugsy.resolve()), "holdout": ["400013", "400060"]}
        found["mugsy"] = {**actor, "subjects": {"mugsy": subject}}
    return {
        name: (Project(folder / f"take{i}", next(iter(p["subjects"]))), p) for i, (name, p) in enumerate(found.items())
    }


def measure(name: str, project: Project, params: dict[str, Any]) -> list[list[str]]:
    """A row of the table for the CPU, and one for the GPU."""
    rows = []
    for device in ("cpu", "cuda"):
        project.write(merged(params, {"train": {"device": device}}))
        project.run("configure", *(("capture", "normalize", "subject") if device == "cpu" else ()), "train")
        report, scores = training_of(project.folders), score(project, 3)
        memory = f"{report['peak_memory_bytes'] / 2**30:.2f} GiB"
        values = [f"{report['seconds']:.1f}", f"{scores.psnr:.2f}", memory, f"{report['rays_per_second']:.0f}"]
        rows.append([name, report["device"], *values])
        typer.echo(" ".join(rows[-1]))
    return rows


@report_user_errors("gpu")
def main(
    folder: Annotated[Path, typer.Argument(help="Where takes are filmed and trained; some 10 GB.")],
    mugsy: Annotated[
        Path | None, typer.Option(help="Folder of the capture `mugsy`; without it that is left out.")
    ] = None,
    write: Annotated[bool, typer.Option("--write", help="Put the table into bench/RESULTS.md.")] = False,
) -> None:
    """Refuses where there is no GPU."""
    device = choose("cuda")
    said = check()
    typer.echo(said)
    rows = [row for name, given in projects(folder, mugsy).items() for row in measure(name, *given)]
    left_out = "" if mugsy is not None else " `mugsy` was not at hand."
    where = f"{now()[:10]}, {machine_name(device.name)}, commit {commit_name()}."
    text = f"{where} tests/gpu on it: {said}.{left_out} Compiling is counted.\n\n{markdown(HEAD, rows)}"
    typer.echo(text)
    if write:
        replace_between(ROOT / "bench" / "RESULTS.md", *MARKS, text)


if __name__ == "__main__":
    typer.run(main)
