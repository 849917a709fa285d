"""What a GPU gives the model `mlp`: `python -m bench.gpu data/actor/scene`, once the stage `normalize` has run.

Of each preset and each device: rays that steps train on a second, memory, and what the whole training would take.
"""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import torch
import typer

from bench.tables import markdown, size
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.errors import report_user_errors
from facefolds_core.params import MlpParams, train_params
from facefolds_core.training import loop
from facefolds_core.training.report import device_name, peak_memory

WARM = 2
"""Steps that are not timed: kernels are loaded in the first."""
HEAD = ("preset", "device", "rays a second", "memory", "whole training")


def settings(preset: str, device: str) -> MlpParams:
    found = train_params({"preset": preset, "device": device})
    assert isinstance(found, MlpParams)
    return found


def timed(scene: Scene, params: MlpParams, seconds: float) -> tuple[float, int]:
    """Seconds a step, over at least `seconds`, and bytes at most."""
    with TemporaryDirectory() as folder:
        run = loop.begin(scene, params, Path(folder))
        done, began = -WARM, time.perf_counter()
        while done < 1 or time.perf_counter() - began < seconds:
            if done == 0:
                began = time.perf_counter()
            loop.train_step(run.state, run.sampler, params)  # reads the loss, so the device has ended
            done += 1
        return (time.perf_counter() - began) / done, peak_memory(run.sampler.device)


def row(scene: Scene, preset: str, device: str, seconds: float) -> tuple[str, ...]:
    params = settings(preset, device)
    step, memory = timed(scene, params, seconds)
    whole = f"{step * params.iterations / 3600:.2f} h"
    return preset, device_name(torch.device(device)), f"{params.rays / step:.0f}", size(memory), whole


def main(
    scene: Annotated[Path, typer.Argument(help="Folder of a scene.")],
    seconds: Annotated[float, typer.Option(help="Of steps, for each preset and device.", min=0)] = 20,
) -> None:
    found = read_scene(scene)
    devices = ["cpu", *(["cuda"] if torch.cuda.is_available() else [])]
    print(markdown(HEAD, [row(found, preset, device, seconds) for preset in ("quick", "paper") for device in devices]))


if __name__ == "__main__":
    with report_user_errors("gpu"):
        typer.run(main)
