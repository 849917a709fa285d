"""How well an asset's frames between frames show what the actor did there, on cameras held out of training.

python -m bench.between data/actor

The actor is procedural, so the truth at any time can be rendered. Ways to fill the time between two frames are scored
against it, from the baked textures on the meshes that ship (no codec): repeating the frame before, mixing both, the
asset's own way (export/between.py), and, as the bound that the model's own error sets, the frames beside it, each
against its own truth on the same pixels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray

from bench.tables import markdown
from facefolds_core.captures.actor import frame_times, make_rig, render
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.config import read_stage, read_subject
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.export.between import Motion, between_rows
from facefolds_core.export.stores import read_meshes
from facefolds_core.frame_store import FrameStore
from facefolds_core.params import CaptureParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.progress import progress
from facefolds_core.rendering import composite
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.scoring.metrics import shown

MOVES = 0.05
"""A pixel moves if a channel of the truths at the time and at the frames around it differs by more between any two."""

Codes = NDArray[np.uint8]
Textures = Sequence[Codes]
Frames = Iterator[tuple[int, Textures]]
Sums = NDArray[np.float64]
"""(K, 4), of the intervals from frame k to k + 1: squared errors over the subject, weighted with its opacity, and these
weights; the same over its pixels that move."""


class Truth(NamedTuple):
    """What one camera would have seen: pictures (M, H, W, 3) and the subject's opacity (M, H, W), uint8, at M times."""

    pictures: Codes
    opacity: Codes


def frames_of(store: FrameStore) -> list[Textures]:
    layers, frames = (1 + max(key[i] for key in store.keys()) for i in (0, 1))  # noqa: SIM118
    return [[store.image(n, k) for n in range(layers)] for k in range(frames)]


def repeated(store: FrameStore, factor: int) -> Frames:
    frames = frames_of(store)
    return ((at, frames[at // factor]) for at in range(factor * (len(frames) - 1)) if at % factor)


def mixed(store: FrameStore, factor: int) -> Frames:
    still, frames = np.zeros((store.height, store.width, 2), np.float32), frames_of(store)
    for at, before in repeated(store, factor):
        mixture = Motion(still, still).at(at % factor / factor)
        yield at, [mixture.image(*pair) for pair in zip(before, frames[at // factor + 1], strict=True)]


def moved(store: FrameStore, factor: int) -> Frames:
    last = factor * (len(frames_of(store)) - 1)
    for at, rows in groupby(between_rows(store, factor, progress=False), lambda row: row[1]):
        textures = [image for _, _, image in rows]
        if at % factor and at < last:
            yield at, textures


METHODS: dict[str, Callable[[FrameStore, int], Frames]] = {
    "repeat": repeated,
    "cross-fade": mixed,
    "ours": moved,
    "frames": lambda store, factor: ((k * factor, textures) for k, textures in enumerate(frames_of(store))),
}
"""The last one is the bound."""


def truth_of(folders: SubjectFolders, scene: Scene, camera: int, factor: int) -> Truth:
    """At all frames of the asset up to the capture's last."""
    params = read_stage(CaptureParams, folders.config)
    view = {view.name: view for view in make_rig(params).cameras}[scene.cameras[camera].name]
    times = frame_times(params.model_copy(update={"frames": factor * params.frames}))
    wanted = times[: factor * (scene.num_frames - 1) + 1]
    found = [render(view, float(t), seed=params.seed) for t in progress(wanted, desc=view.name, unit="picture")]
    opacity = [np.rint(255 * picture.opacity).astype(np.uint8) for picture in found]
    return Truth(np.stack([picture.rgb for picture in found]), np.stack(opacity))


def score(frame: int, picture: NDArray[np.float32], truth: Truth, at: int, factor: int) -> Sums:
    """(4,) of a picture over black, against the truth at index `at`, in the interval of the capture's frame `frame`."""
    around = truth.pictures[frame * factor : (frame + 1) * factor + 1].astype(np.int16)
    moves = (around.max(0) - around.min(0)).max(-1) > MOVES * 255
    square = ((shown(picture) - truth.pictures[at] / 255.0) ** 2).mean(-1)
    weight = truth.opacity[at] / 255.0
    return np.array([(values * part).sum() for part in (weight, weight * moves) for values in (square, 1.0)])


def fast_intervals(repeat: Sums) -> NDArray[np.bool_]:
    """(K,): the half of the intervals (rounded down) with the largest share of pixels that move."""
    order = np.argsort(-repeat[:, 3] / repeat[:, 1], kind="stable")
    return np.isin(np.arange(len(repeat)), order[: len(repeat) // 2])


def decibels(sums: Sums, moving: bool) -> float:
    """PSNR over all pixels of a region of all pictures together."""
    error, weight = sums[:, 2:].sum(0) if moving else sums[:, :2].sum(0)
    return float(-10 * np.log10(error / weight)) if weight and error else float("nan")


def table(found: Mapping[str, Sums]) -> str:
    """Markdown."""
    fast = fast_intervals(found["repeat"])
    kinds = {"all": fast | True, "fast": fast, "still": ~fast}
    columns = [(moving, kind) for moving in (True, False) for kind in kinds]
    rows = [
        [method, *(f"{decibels(sums[kinds[kind]], moving):.2f}" for moving, kind in columns)]
        for method, sums in found.items()
    ]
    return markdown(["between frames", *(f"{kind}, {'moving' if m else 'subject'}" for m, kind in columns)], rows)


def measure(folders: SubjectFolders, factor: int) -> dict[str, Sums]:
    """Of all times between frames, by METHODS; the bound is scored in both intervals beside a frame.

    Raises:
        UserError: if the scene does not hold the actor's pictures as they were rendered.
    """
    wrong = UserError(
        "there is no truth between the frames of this capture",
        file=folders.scene,
        expected="what the actor's renderer shows: its pictures at their own size, its head still",
        remedy="give the folder of a subject of source actor with default `normalize`, e.g. data/actor",
    )
    if read_subject(folders.config).source != "actor":
        raise wrong
    scene = read_scene(folders.scene)
    store, meshes = FrameStore(folders.textures / "textures.arrow"), read_meshes(folders.meshes / "meshes.npz")
    found = {method: np.zeros((scene.num_frames - 1, 4)) for method in METHODS}
    for camera in scene.indices(scene.choice_split):
        truth, hits = truth_of(folders, scene, camera, factor), cast_layers(scene.cameras[camera], meshes)
        if scene.poses is not None or not np.array_equal(truth.pictures[0], scene.open_frames().image(camera, 0)):
            raise wrong
        for method, fill in METHODS.items():
            for at, textures in fill(store, factor):
                picture = composite(hits, textures)[0]
                for interval in {at // factor, (at - 1) // factor} & set(range(scene.num_frames - 1)):
                    found[method][interval] += score(interval, picture, truth, at, factor)
    return found


def main(
    subject: Annotated[Path, typer.Argument(help="Folder of an exported actor: scene, meshes, textures.")],
    factor: Annotated[int, typer.Option(min=2, max=3, help="Times the capture's frame rate.")] = 2,
) -> None:
    """Score frames between frames against the actor's truth."""
    with report_user_errors("between"):
        found = measure(SubjectFolders(subject), factor)
        typer.echo(f"\n{factor} times the frame rate; dB against the truth, held-out cameras\n{table(found)}")
        fast = np.flatnonzero(fast_intervals(found["repeat"]))
        typer.echo(f"fast: the intervals after frames {', '.join(map(str, fast))}")


if __name__ == "__main__":
    typer.run(main)
